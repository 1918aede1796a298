// Points of Sobol's sequence: how evenly they cover the unit square and its sides.

#include "precompute/sampling/sobol_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace rebounce::test_sobol_blocks {
namespace {

constexpr std::uint64_t kBits = 20261;

/// The coordinates in one dimension of `count` blocks from `first` on.
std::vector<float> coordinates(int dimension, std::uint32_t first, std::uint32_t count) {
  const SobolBlocks sequence(kBits);
  SobolBlocks::Block block;
  std::vector<float> x;
  for (std::uint32_t number = first; number < first + count; ++number) {
    sequence.fill(number, SobolBlocks::kSize, block);
    for (const float coordinate : block[dimension]) x.push_back(coordinate);
  }
  return x;
}

/// First block and number of blocks, a power of two that divides the first.
constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 5> kAligned = {
    {{0, 1}, {5, 1}, {0, 4}, {4, 4}, {16, 16}}};

TEST(SobolBlocks, AlignedBlocksHaveOnePointInEachStratum) {
  for (int dimension = 0; dimension < SobolBlocks::kDimensions; ++dimension) {
    for (const auto& [first, count] : kAligned) {
      std::vector<int> stratum;
      const std::vector<float> points = coordinates(dimension, first, count);
      for (const float x : points) {
        ASSERT_GE(x, 0);
        ASSERT_LT(x, 1);
        stratum.push_back(static_cast<int>(x * static_cast<float>(points.size())));
      }
      std::ranges::sort(stratum);
      for (int k = 0; k < static_cast<int>(stratum.size()); ++k) EXPECT_EQ(stratum[k], k);
    }
  }
}

TEST(SobolBlocks, FirstTwoDimensionsHaveOnePointInEachCell) {
  const std::vector<float> x = coordinates(0, 0, 1), y = coordinates(1, 0, 1);
  for (const int columns : {2, 4, 8, 16, 32}) {
    const int rows = static_cast<int>(SobolBlocks::kSize) / columns;
    std::vector<int> cell;
    for (std::size_t k = 0; k < x.size(); ++k) {
      cell.push_back(static_cast<int>(x[k] * static_cast<float>(columns)) * rows +
                     static_cast<int>(y[k] * static_cast<float>(rows)));
    }
    std::ranges::sort(cell);
    for (int k = 0; k < static_cast<int>(cell.size()); ++k) EXPECT_EQ(cell[k], k) << columns;
  }
}

TEST(SobolBlocks, PartOfABlockIsItsBeginning) {
  const SobolBlocks sequence(kBits);
  SobolBlocks::Block whole, part;
  sequence.fill(3, SobolBlocks::kSize, whole);
  sequence.fill(3, 7, part);
  for (int d = 0; d < SobolBlocks::kDimensions; ++d) {
    for (int k = 0; k < 7; ++k) EXPECT_EQ(part[d][k], whole[d][k]);
  }
}

}  // namespace
}  // namespace rebounce::test_sobol_blocks
