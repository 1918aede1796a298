#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "transfer/format/hierarchical_encoding.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_integer_encoding {
namespace {

constexpr std::uint32_t kSide = 64;

/// One block of low rank between two halves of the patches, with orthonormal bases (cosines) and a
/// coupling matrix of one matrix whose diagonal is `coupling`; residuals at its ends.
HierarchicalStorage block_with(const std::vector<float>& coupling,
                               std::uint32_t row_residual_rank = 0,
                               std::uint32_t column_residual_rank = 0) {
  const auto rank = static_cast<std::uint32_t>(coupling.size());
  HierarchicalStorage storage;
  storage.area.assign(2 * kSide, 1.0F);
  for (std::uint32_t p = 0; p < 2 * kSide; ++p) storage.patch.push_back(p);
  storage.matrix_count = 1;
  storage.blocks.push_back({kSide, kSide, 0, kSide, TransferBlock::Kind::kLowRank, rank, rank,
                            row_residual_rank, column_residual_rank});
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
    for (std::uint32_t c = 0; c < rank; ++c) values.push_back(r == c ? coupling[r] : 0);
  }
  values.resize(values.size() + HierarchicalFormat::kPadding);
  storage.values_f32 = SharedArray(std::move(values));
  return storage;
}

/// Frobenius norm of what an encoding changes.
double change(const HierarchicalStorage& exact, const HierarchicalStorage& encoded) {
  const std::size_t n = exact.area.size();
  std::vector<float> a(n * n), b(n * n);
  HierarchicalOperator(exact).expand(0, a);
  HierarchicalOperator(encoded).expand(0, b);
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::pow(double{a[k]} - b[k], 2);
  return std::sqrt(sum);
}

TEST(IntegerEncoding, ResidualsAreAsGoodAsSixteenBits) {
  const std::vector<float> coupling{1, 0.03F, 0.002F, 0.001F};
  const double bytes =
      change(block_with(coupling), encode_values(block_with(coupling), Precision::kQ8));
  // The step of the largest vectors is 0.18 / 127.
  EXPECT_GT(bytes, 4e-3);
  EXPECT_LT(bytes, 1e-2);
  const auto exact = block_with(coupling, 1, 2);
  const auto encoded = encode_values(exact, Precision::kQ8);
  EXPECT_EQ(encoded.blocks.front().row_rank, 4U);
  EXPECT_EQ(encoded.blocks.front().row_residual_rank, 1U);
  EXPECT_EQ(encoded.blocks.front().column_residual_rank, 2U);
  EXPECT_LT(change(exact, encoded), 1e-3);
  // Five and six vectors instead of four at each end are eight: they come in groups of four.
  const auto plain = encode_values(block_with(coupling), Precision::kQ8);
  EXPECT_EQ(HierarchicalOperator(encoded).bytes(), HierarchicalOperator(plain).bytes() + 8 * kSide);
}

TEST(IntegerEncoding, ResidualsAtOneEndLeaveTheOther) {
  const auto exact = block_with({1, 0.03F}, 1, 0);
  const double one = change(exact, encode_values(exact, Precision::kQ8));
  const auto plain = block_with({1, 0.03F});
  const double none = change(plain, encode_values(plain, Precision::kQ8));
  EXPECT_NEAR(one / none, std::sqrt(0.5), 0.1);
}

TEST(IntegerEncoding, OthersHaveNoResiduals) {
  const auto exact = block_with({1, 0.03F, 0.002F, 0.001F}, 2, 2);
  const auto encoded = encode_values(exact, Precision::kF16);
  EXPECT_EQ(encoded.blocks.front().row_residual_rank, 0U);
  EXPECT_LT(change(exact, encoded), 1e-3);
}

TEST(IntegerEncoding, NothingStaysNothing) {
  const auto exact = block_with({0, 0});
  EXPECT_EQ(change(exact, encode_values(exact, Precision::kQ8)), 0);
}

}  // namespace
}  // namespace rebounce::test_integer_encoding
