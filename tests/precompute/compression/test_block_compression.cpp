// A block by itself, with singular values that are known.

#include "precompute/compression/block_compression.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace rebounce::test_block_compression {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_orthonormal(Index rows, Index columns, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const MatrixXd random = MatrixXd::NullaryExpr(rows, columns, [&] { return normal(engine); });
  return Eigen::HouseholderQR<MatrixXd>(random).householderQ() * MatrixXd::Identity(rows, columns);
}

WideBlock block_with(Index size, const VectorXd& singular) {
  WideBlock block;
  block.entries = random_orthonormal(size, singular.size(), 1) * singular.asDiagonal() *
                  random_orthonormal(size, singular.size(), 2).transpose();
  return block;
}

/// k^-exponent.
VectorXd powers(Index count, double exponent) {
  return VectorXd::LinSpaced(count, 1, static_cast<double>(count)).array().pow(-exponent);
}

MatrixXd product(const LowRankBlock& block) {
  return block.row_basis * block.couplings.front() * block.column_basis.transpose();
}

constexpr double kNoLimit = 1e30;

TEST(BlockCompression, SaysItsErrorAndTakesTheRankThatPays) {
  for (const Index size : {96, 400}) {  // from the Gram matrix; sketched
    const VectorXd singular = powers(size / 2, 2);
    const WideBlock block = block_with(size, singular);
    const double enough = singular[11] * singular[11] * 1.01;
    const CompressionCost cost{.multiplier = enough / static_cast<double>(2 * size + 12 * 12)};
    const auto attempt = compress_block(block, cost, kNoLimit, size / 8, 3);
    ASSERT_TRUE(attempt.block);
    EXPECT_GE(attempt.block->row_basis.cols(), 10) << size;
    EXPECT_LE(attempt.block->row_basis.cols(), size < 100 ? 12 : 16) << size;
    const double error = (block.entries - product(*attempt.block)).squaredNorm();
    EXPECT_NEAR(attempt.block->error_squared / error, 1, 1e-6) << size;
    EXPECT_NEAR(
        cost.of(*attempt.block),
        error + cost.multiplier * cost.size(attempt.block->basis_values(), attempt.block->vectors(),
                                            attempt.block->coupling_values()),
        1e-9);
  }
}

TEST(BlockCompression, VectorsThatCostMoreAreFewer) {
  for (const Index size : {96, 400}) {
    const WideBlock block = block_with(size, powers(size / 2, 1));
    const auto rank = [&](double vector) {
      const auto attempt = compress_block(block, {.multiplier = 1e-4, .sizes = {.vector = vector}},
                                          kNoLimit, size, 3);
      return attempt.block ? attempt.block->row_basis.cols() : 0;
    };
    // Energies fall with the square of their number: of directions that take twice as much, some
    // 0.7 are worth it.
    const double few = static_cast<double>(rank(static_cast<double>(size)));
    const double many = static_cast<double>(rank(0));
    EXPECT_GE(few, 0.6 * many) << size;
    EXPECT_LE(few, 0.9 * many) << size;
  }
}

ClusterWeight random_weight(Index positions, std::uint64_t seed) {
  const VectorXd background = (1 + 0.5 * VectorXd::LinSpaced(positions, -1, 1).array()).matrix();
  return {background, random_orthonormal(positions, 3, seed), Eigen::Vector3d(4, 2, 1)};
}

/// Products of narrow matrices, one for each of two matrices, and a dense part of both.
JointEntryParts structured_entries(Index rows, Index columns) {
  const auto indices = [](Index begin, Index count) {
    std::vector<std::uint32_t> list(static_cast<std::size_t>(count));
    std::iota(list.begin(), list.end(), static_cast<std::uint32_t>(begin));
    return list;
  };
  JointEntryParts parts;
  for (const Index rank : {30, 17}) {
    const auto seed = static_cast<std::uint64_t>(rank);
    const MatrixXd right =
        random_orthonormal(columns, rank, seed + 1) * powers(rank, 2).asDiagonal();
    parts.own.push_back(
        {{indices(0, rows), indices(0, columns), random_orthonormal(rows, rank, seed).cast<float>(),
          right.cast<float>()}});
  }
  const MatrixXd dense = 0.02 * random_orthonormal(20, 10, 9);
  parts.common.push_back({indices(40, 20), indices(5, 10), dense.cast<float>(), {}});
  return parts;
}

/// The entries of such parts, weighted on both sides.
WideBlock entries_of(const JointEntryParts& parts, const StructuredBlock::Sides& sides) {
  WideBlock block;
  block.matrix_count = static_cast<Index>(parts.own.size());
  block.entries.resize(sides.rows, block.matrix_count * sides.columns);
  const RowVectors all = RowVectors::Identity(sides.columns, sides.columns);
  for (Index m = 0; m < block.matrix_count; ++m) {
    RowVectors sum = RowVectors::Zero(sides.rows, sides.columns);
    add_product(parts.common, all, sum);
    add_product(parts.own[static_cast<std::size_t>(m)], all, sum);
    MatrixXd weighted = sum.cast<double>();
    if (sides.row_weight != nullptr) sides.row_weight->weigh_rows(weighted);
    if (sides.column_weight != nullptr) sides.column_weight->weigh_columns(weighted);
    block.entries.middleCols(m * sides.columns, sides.columns) = weighted;
  }
  return block;
}

TEST(BlockCompression, StructuredBlocksAreCompressedAsTheirEntriesAre) {
  constexpr Index kRows = 320, kColumns = 200;
  const ClusterWeight row_weight = random_weight(kRows, 5),
                      column_weight = random_weight(kColumns, 6);
  for (const bool weighted : {false, true}) {
    const StructuredBlock::Sides sides{.rows = kRows,
                                       .columns = kColumns,
                                       .row_weight = weighted ? &row_weight : nullptr,
                                       .column_weight = &column_weight,
                                       .on_diagonal = false};
    const JointEntryParts parts = structured_entries(kRows, kColumns);
    const WideBlock entries = entries_of(parts, sides);
    const StructuredBlock block(parts, sides, 11);
    EXPECT_NEAR(block.energy() / entries.entries.squaredNorm(), 1, 0.4);
    for (const double multiplier : {1e-5, 1e-8}) {
      const CompressionCost cost{.multiplier = multiplier};
      const auto of_parts = compress_block(block, cost, kNoLimit, 20, 3);
      const auto of_entries = compress_block(entries, cost, kNoLimit, 20, 3);
      ASSERT_TRUE(of_parts.block && of_entries.block);
      EXPECT_NEAR(of_parts.block->row_basis.cols(), of_entries.block->row_basis.cols(), 1);
      EXPECT_NEAR(of_parts.block->column_basis.cols(), of_entries.block->column_basis.cols(), 1);
      double error = 0;
      for (Index m = 0; m < 2; ++m) {
        const LowRankBlock& found = *of_parts.block;
        error += (entries.matrix(m) -
                  found.row_basis * found.couplings[m] * found.column_basis.transpose())
                     .squaredNorm();
      }
      EXPECT_NEAR(of_parts.block->error_squared / error, 1, 0.2);
      EXPECT_NEAR(of_entries.block->error_squared / error, 1, 0.05);
    }
  }
}

TEST(BlockCompression, RefusesWhatCostsMoreThanTheLimit) {
  const WideBlock block = block_with(200, powers(100, 1));
  const CompressionCost cost{.multiplier = 1e-6};
  const auto any = compress_block(block, cost, kNoLimit, 200, 3);
  ASSERT_TRUE(any.block);
  EXPECT_FALSE(compress_block(block, cost, 0.9 * cost.of(*any.block), 200, 3).block);
}

TEST(BlockCompression, MoreRanksCostNoLessThanWasSaid) {
  // Powers, and exponentials, which fall faster.
  constexpr Index kSize = 512, kFew = 32;
  std::vector<VectorXd> spectra;
  for (const double exponent : {0.6, 1.0, 1.5, 2.5}) spectra.push_back(powers(kSize, exponent));
  for (const double base : {0.9, 0.97}) {
    spectra.emplace_back(VectorXd::NullaryExpr(kSize, [=](Index k) { return std::pow(base, k); }));
  }
  int told = 0;
  for (const VectorXd& singular : spectra) {
    const WideBlock block = block_with(kSize, singular);
    const double energy = block.entries.squaredNorm();
    for (const double multiplier : {1e-4, 1e-5, 1e-6, 1e-7}) {
      const CompressionCost cost{.multiplier = multiplier * energy / static_cast<double>(kSize)};
      const auto few = compress_block(block, cost, kNoLimit, kFew, 3);
      const auto any = compress_block(block, cost, kNoLimit, kSize, 3);
      ASSERT_TRUE(few.block && any.block);
      if (any.block->row_basis.cols() > kFew) {
        // The factor by which a sketch misses too much is one in the mean.
        EXPECT_GE(cost.of(*any.block), 0.95 * few.least_beyond) << singular[1] << ' ' << multiplier;
      }
      if (few.least_beyond >= cost.of(*few.block)) ++told;
    }
  }
  EXPECT_GE(told, 4);  // or nothing would be saved
}

TEST(BlockCompression, BlocksThatAreQuicklyTriedSayNothing) {
  const WideBlock block = block_with(128, powers(128, 1));
  EXPECT_EQ(compress_block(block, {.multiplier = 1e-4}, kNoLimit, 8, 3).least_beyond, 0);
}

}  // namespace
}  // namespace rebounce::test_block_compression
