#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "rebounce/transfer/hierarchical_operator.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kSide = 64;

/// One block of low rank between two halves of the patches, with orthonormal bases (cosines) and a
/// core of one matrix whose diagonal is `core`.
HierarchicalOperator::Storage block_with(const std::vector<float>& core) {
  const auto rank = static_cast<std::uint32_t>(core.size());
  HierarchicalOperator::Storage storage;
  storage.area.assign(2 * kSide, 1.0F);
  for (std::uint32_t p = 0; p < 2 * kSide; ++p) storage.patch.push_back(p);
  storage.matrix_count = 1;
  storage.blocks.push_back({kSide, kSide, 0, kSide, TransferBlock::Kind::kLowRank, rank, rank});
  std::vector<float> values;
  for (int end = 0; end < 2; ++end) {
    for (std::uint32_t r = 0; r < rank; ++r) {
      for (std::uint32_t k = 0; k < kSide; ++k) {
        const double phase = M_PI / kSide * (k + 0.5) * (r + 1);
        values.push_back(static_cast<float>(std::sqrt(2.0 / kSide) * std::cos(phase)));
      }
    }
  }
  for (std::uint32_t r = 0; r < rank; ++r) {
    for (std::uint32_t c = 0; c < rank; ++c) values.push_back(r == c ? core[r] : 0);
  }
  values.resize(values.size() + HierarchicalOperator::kPadding);
  storage.values_f32 = SharedArray(std::move(values));
  return storage;
}

/// Frobenius norm of what an encoding changes.
double change(const HierarchicalOperator::Storage& exact,
              const HierarchicalOperator::Storage& encoded) {
  const std::size_t n = exact.area.size();
  std::vector<float> a(n * n), b(n * n);
  HierarchicalOperator(exact).expand(0, a);
  HierarchicalOperator(encoded).expand(0, b);
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::pow(double{a[k]} - b[k], 2);
  return std::sqrt(sum);
}

TEST(IntegerEncoding, RemaindersGoToTheLargestEntries) {
  const auto exact = block_with({1, 0.03F, 0.002F, 0.001F});
  const auto bytes = HierarchicalOperator::encode_bytes(exact);
  ASSERT_EQ(bytes.blocks.size(), 1U);
  const TransferBlock& block = bytes.blocks.front();
  EXPECT_EQ(block.row_rank, 4U);
  EXPECT_EQ(block.row_remainders, 1U);
  EXPECT_EQ(block.column_remainders, 1U);
  // Without remainders the first vector alone is some 0.3 % off at each end.
  EXPECT_LT(change(exact, bytes), 1e-3);
}

TEST(IntegerEncoding, RemaindersAreThoseOfTheFirstVectors) {
  // The third vector needs one, so that those before it have one too.
  const auto bytes = HierarchicalOperator::encode_bytes(block_with({0.002F, 0.001F, 1, 0.001F}));
  EXPECT_EQ(bytes.blocks.front().row_remainders, 3U);
  EXPECT_EQ(bytes.blocks.front().column_remainders, 3U);
}

TEST(IntegerEncoding, EntriesOfOneSizeNeedNoRemainders) {
  const auto exact = block_with({1, 0.9F, 0.8F, 0.7F});
  const auto bytes = HierarchicalOperator::encode_bytes(exact);
  EXPECT_EQ(bytes.blocks.front().row_remainders, 0U);
  EXPECT_EQ(bytes.blocks.front().column_remainders, 0U);
  EXPECT_LT(change(exact, bytes), 0.02);
}

TEST(IntegerEncoding, ShortsHaveNoRemainders) {
  const auto exact = block_with({1, 0.03F, 0.002F, 0.001F});
  const auto shorts = HierarchicalOperator::encode_shorts(exact);
  EXPECT_EQ(shorts.blocks.front().row_remainders, 0U);
  EXPECT_LT(change(exact, shorts), 5e-4);
}

TEST(IntegerEncoding, NothingStaysNothing) {
  const auto exact = block_with({0, 0});
  EXPECT_EQ(change(exact, HierarchicalOperator::encode_bytes(exact)), 0);
}

}  // namespace
}  // namespace rebounce
