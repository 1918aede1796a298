#include <gtest/gtest.h>

#include <Eigen/QR>

#include "precompute/compression/residual_ranks.h"

namespace rebounce::test_residual_ranks {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kSize = 64;

/// Bases of random orthonormal vectors, one matrix whose coupling matrix is `coupling` on
/// its diagonal.
LowRankBlock block_with(const VectorXd& coupling, bool on_diagonal = false) {
  std::srand(3);
  const auto basis = [&] {
    const Eigen::HouseholderQR<MatrixXd> qr(MatrixXd::Random(kSize, coupling.size()));
    return MatrixXd(qr.householderQ() * MatrixXd::Identity(kSize, coupling.size()));
  };
  LowRankBlock block;
  block.row_basis = basis();
  block.on_diagonal = on_diagonal;
  if (!on_diagonal) block.column_basis = basis();
  block.couplings.push_back(coupling.asDiagonal());
  return block;
}

/// Strong light from anywhere, or in one direction.
ClusterWeight weight(double background, double strength) {
  return {VectorXd::Constant(kSize, background), VectorXd::Unit(kSize, 5),
          VectorXd::Constant(1, strength)};
}

MatrixXd random_errors(Index count) {
  std::srand(5);
  return MatrixXd::Random(count, kSize);
}

TEST(ResidualRanks, GoToTheLargestEntriesFirst) {
  const ClusterWeight even = weight(1, 0);
  const LowRankBlock block = block_with(VectorXd{{1, 0.1, 0.01}});
  // A vector is off by some (0.4 / 127)²/12 of its energy at each of 64 positions.
  for (const auto& [multiplier, expected] :
       {std::pair(1e-4, 0), std::pair(1e-7, 1), std::pair(2e-9, 2), std::pair(1e-12, 3)}) {
    const ResidualRanks found =
        find_residual_ranks(block, {&even, &even}, {.multiplier = multiplier});
    EXPECT_EQ(found.row, expected) << multiplier;
    EXPECT_EQ(found.column, expected) << multiplier;
  }
}

TEST(ResidualRanks, AreThoseOfTheFirstVectors) {
  const ClusterWeight even = weight(1, 0);
  const LowRankBlock block = block_with(VectorXd{{0.001, 0.001, 1, 0.001}});
  EXPECT_EQ(find_residual_ranks(block, {&even, &even}, {.multiplier = 1e-7}).row, 3);
}

TEST(ResidualRanks, OnTheDiagonalBothEndsAreOne) {
  const ClusterWeight even = weight(1, 0);
  const LowRankBlock block = block_with(VectorXd{{1, 0.1, 0.01}}, true);
  const ResidualRanks found = find_residual_ranks(block, {&even, &even}, {.multiplier = 1e-7});
  EXPECT_EQ(found.row, 1);
  EXPECT_EQ(found.column, 1);
}

TEST(ResidualRanks, WhereLightIsStrongThereAreMore) {
  const ClusterWeight even = weight(1, 0), strong = weight(30, 0);
  const LowRankBlock block = block_with(VectorXd{{1, 0.1, 0.01}});
  const CompressionCost cost{.multiplier = 1e-7};
  EXPECT_EQ(find_residual_ranks(block, {&even, &even}, cost).row, 1);
  EXPECT_EQ(find_residual_ranks(block, {&strong, &even}, cost).row, 2);
  EXPECT_EQ(find_residual_ranks(block, {&even, &strong}, cost).row, 2);
}

TEST(ResidualRanks, NoneWhereTheOtherEndHasNoRank) {
  const ClusterWeight even = weight(1, 0);
  const ClusterWeight wider = {VectorXd::Ones(2 * kSize), VectorXd::Unit(2 * kSize, 5),
                               VectorXd::Zero(1)};
  LowRankBlock block = block_with(VectorXd{{1, 0.1, 0.01}});
  block.column_basis.resize(2 * kSize, 0);
  block.couplings = {MatrixXd(3, 0)};
  const ResidualRanks found = find_residual_ranks(block, {&even, &wider}, {.multiplier = 1e-7});
  EXPECT_EQ(found.row, 0);
  EXPECT_EQ(found.column, 0);
}

TEST(ResidualRanks, NoneWhereNothingIsWanted) {
  const LowRankBlock block = block_with(VectorXd{{1, 0.1}});
  EXPECT_EQ(find_residual_ranks(block, {}, {.multiplier = 1e-12}).row, 0);
}

TEST(ClusterWeights, SquaredNormIsThatOfTheMatrix) {
  const ClusterWeight lit(VectorXd::LinSpaced(kSize, 1, 3), VectorXd::Unit(kSize, 5),
                          VectorXd::Constant(1, 4));
  MatrixXd whole = MatrixXd::Identity(kSize, kSize);
  lit.weigh_columns(whole);
  EXPECT_NEAR(lit.squared_norm(), whole.squaredNorm(), 1e-9 * whole.squaredNorm());
  // So are errors that are as large at all positions, in the mean.
  MatrixXd errors = random_errors(20000);
  const double before = errors.squaredNorm() / kSize;
  lit.weigh_columns(errors);
  EXPECT_NEAR(errors.squaredNorm() / before, lit.squared_norm(), 0.02 * lit.squared_norm());
}

}  // namespace
}  // namespace rebounce::test_residual_ranks
