// The kernels of form factors in blocks: every instruction set against the portable one.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/random_pairs.h"
#include "transfer/kernels/kernels.h"

namespace rebounce::test_gather_kernels {
namespace {

constexpr std::size_t kCount = 500, kStride = kCount * kFormFactorBlock;

/// A row of blocks side by side, and what it gathers from.
struct Row {
  std::vector<FormFactorBlock> values = std::vector<FormFactorBlock>(kCount);
  std::vector<std::uint32_t> position = std::vector<std::uint32_t>(kCount);
  std::vector<float> x = std::vector<float>(kChannelCount * kStride);
  Float3 value{1, 2, 3};

  Row() {
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (std::uint32_t k = 0; k < kCount; ++k) {
      position[k] = k;
      for (float& f : values[k].value) f = uniform(engine);
    }
    for (float& v : x) v = uniform(engine);
  }
};

/// What a set of kernels makes of the row.
struct Products {
  Float3 gathered{}, gathered_and_spread{};
  std::vector<float> spread, spread_beside;

  Products(const Row& row, const GatherKernels& kernels) : spread(row.x), spread_beside(row.x) {
    const auto* const values = row.values.data();
    const auto* const position = row.position.data();
    kernels.gather(values, position, kCount, row.x.data(), kStride, gathered.data());
    kernels.spread(values, position, kCount, row.value.data(), spread.data(), kStride);
    kernels.gather_and_spread(values, position, kCount, row.value.data(), row.x.data(),
                              spread_beside.data(), kStride, gathered_and_spread.data());
  }
};

TEST(GatherKernels, InstructionSetsAgree) {
  const Row row;
  const Products expected(row, kKernelsPortable.gather);
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    const Products products(row, set->gather);
    // Sums of 4,000 products in another order.
    test::expect_near_relative(products.gathered, expected.gathered, 1e-6);
    test::expect_near_relative(products.gathered_and_spread, expected.gathered_and_spread, 1e-5);
    EXPECT_EQ(products.spread, products.spread_beside);
    for (std::size_t k = 0; k < row.x.size(); ++k) {
      // One multiply-add with one rounding or with two.
      EXPECT_NEAR(products.spread[k], expected.spread[k], 1e-6F * expected.spread[k]);
    }
  }
}

}  // namespace
}  // namespace rebounce::test_gather_kernels
