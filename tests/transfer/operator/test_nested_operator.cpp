// Operators with cluster bases, and those that are equilibrated: scaled at every patch.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/hierarchical_samples.h"
#include "tests/support/operator_checks.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test_nested_operator {
namespace {

using test::expect_error;
using test::random_nested_storage;
using test::unaided_product;

/// One matrix over patches of 1 m^2, each at its own position.
HierarchicalStorage storage_without_blocks(std::size_t patch_count) {
  HierarchicalStorage storage;
  storage.area.assign(patch_count, 1.0F);
  storage.patch.resize(patch_count);
  std::iota(storage.patch.begin(), storage.patch.end(), 0U);
  storage.matrix_count = 1;
  return storage;
}

TEST(NestedOperator, TheTestOperatorHasClusterBasesOnAllSides) {
  int rows = 0, both = 0, diagonal = 0, neither = 0;
  const std::size_t positions = HierarchicalFormat::position_count(1000);
  for (const std::uint64_t seed : {1U, 6U, 11U, 12U, 1003U}) {
    for (const TransferBlock& block : random_nested_storage(1000, 3, seed).blocks) {
      if (block.kind != TransferBlock::Kind::kLowRank) continue;
      const bool row = block.row_begin >= positions, column = block.column_begin >= positions;
      (block.on_diagonal() ? (row ? diagonal : neither) : column ? both : row ? rows : neither)++;
    }
  }
  for (const int count : {rows, both, diagonal, neither}) EXPECT_GE(count, 3);
}

TEST(NestedOperator, ClusterBasesAreTheProductsThatTheyStandFor) {
  // One block of rank one over the cluster coefficients of all positions but its own mirror
  // image's: Yhat = u v^T + v u^T with u = W D t and v = W D s, written out.
  HierarchicalStorage storage = storage_without_blocks(64);
  std::vector<float> values;
  const auto take = [&](std::size_t count, auto value) {
    for (std::size_t k = 0; k < count; ++k) values.push_back(value(static_cast<float>(k)));
  };
  for (const std::uint32_t begin : {0U, 32U}) {
    storage.blocks.push_back({.row_begin = begin,
                              .row_count = 32,
                              .column_begin = 64 + begin / 2,
                              .column_count = 16,
                              .kind = TransferBlock::Kind::kClusterBasis,
                              .row_rank = 16});
    take(16 * 32, [&](float k) { return std::sin(k + static_cast<float>(begin)); });
  }
  for (int k = 0; k < 32; ++k)
    storage.coefficient_scale.push_back(1 + 0.1F * static_cast<float>(k));
  storage.blocks.push_back({.row_begin = 80,
                            .row_count = 16,
                            .column_begin = 64,
                            .column_count = 16,
                            .kind = TransferBlock::Kind::kLowRank,
                            .row_rank = 1,
                            .column_rank = 1});
  take(16, [](float k) { return std::cos(k); });
  take(16, [](float k) { return std::cos(2 * k); });
  take(1, [](float) { return 0.25F; });
  values.resize(values.size() + HierarchicalFormat::kPadding);
  const auto vector_of = [&](std::size_t cell) {
    std::vector<double> u(32);
    for (std::size_t m = 0; m < 16; ++m) {
      const double t =
          values[2 * 512 + (1 - cell) * 16 + m] * storage.coefficient_scale[16 * cell + m];
      for (std::size_t k = 0; k < 32; ++k) u[k] += t * values[cell * 512 + m * 32 + k];
    }
    return u;
  };
  const std::vector<double> rows = vector_of(1), columns = vector_of(0);
  storage.values_f32 = SharedArray(std::vector<float>(values));
  const HierarchicalOperator op(storage);
  std::vector<float> y(64 * 64);
  op.expand(0, y);
  for (std::size_t i = 0; i < 32; ++i) {
    for (std::size_t j = 0; j < 32; ++j) {
      const double entry = 0.25 * rows[i] * columns[j];
      EXPECT_NEAR(y[(32 + i) * 64 + j], entry, 1e-4);
      EXPECT_NEAR(y[j * 64 + 32 + i], entry, 1e-4);
      EXPECT_EQ(y[i * 64 + j], 0);
    }
  }
}

TEST(NestedOperator, ReceiversHaveTheLightOfClusterBasesThatBeginWithinARun) {
  // Three cells with 13, 12 and 7 cluster coefficients, and one block over all of them.
  HierarchicalStorage storage = storage_without_blocks(64);
  std::vector<float> values;
  const auto take = [&](std::uint32_t count) {
    for (std::uint32_t k = 0; k < count; ++k) {
      values.push_back(std::sin(static_cast<float>(values.size())));
    }
  };
  std::uint32_t begin = 0, coefficient = 64;
  for (const auto& [size, rank] : {std::pair(16U, 13U), std::pair(16U, 12U), std::pair(32U, 7U)}) {
    storage.blocks.push_back({.row_begin = begin,
                              .row_count = size,
                              .column_begin = coefficient,
                              .column_count = rank,
                              .kind = TransferBlock::Kind::kClusterBasis,
                              .row_rank = rank});
    take(rank * size);
    begin += size;
    coefficient += rank;
  }
  storage.coefficient_scale.assign(32, 1.0F);
  storage.blocks.push_back({.row_begin = 64,
                            .row_count = 32,
                            .column_begin = 64,
                            .column_count = 32,
                            .kind = TransferBlock::Kind::kLowRank,
                            .row_rank = 1,
                            .column_rank = 1});
  take(32 + 1);
  values.resize(values.size() + HierarchicalFormat::kPadding);
  storage.values_f32 = SharedArray(std::move(values));
  const HierarchicalOperator op(storage);
  const std::vector<Float3> m0 = test::random_light(64, 5, 100), whole = unaided_product(op, m0);
  std::vector<std::uint32_t> patches(16);
  std::iota(patches.begin(), patches.end(), 16U);
  std::vector<Float3> some(64);
  std::vector<float> workspace(op.workspace_size());
  op.apply_to(op.receivers(patches), m0, some, workspace);
  for (const std::uint32_t i : patches) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(some[i][c], whole[i][c], 1e-4F * std::abs(whole[i][c]) + 1e-4F) << i;
    }
  }
}

TEST(NestedOperator, RefusesABlockOverAPartOfAClusterBasis) {
  const auto storage_with = [](std::uint32_t row_begin, std::uint32_t row_count) {
    HierarchicalStorage storage = storage_without_blocks(32);
    storage.blocks = {{.row_begin = 0,
                       .row_count = 32,
                       .column_begin = 32,
                       .column_count = 32,
                       .kind = TransferBlock::Kind::kClusterBasis,
                       .row_rank = 32},
                      {.row_begin = row_begin,
                       .row_count = row_count,
                       .column_begin = 0,
                       .column_count = 16,
                       .kind = TransferBlock::Kind::kLowRank,
                       .row_rank = 1,
                       .column_rank = 1}};
    storage.coefficient_scale.assign(32, 1.0F);
    storage.values_f32 = SharedArray(
        std::vector<float>(32 * 32 + row_count + 16 + 1 + HierarchicalFormat::kPadding, 1.0F));
    return storage;
  };
  EXPECT_NO_THROW(HierarchicalOperator(storage_with(32, 32)));
  for (const std::uint32_t begin : {32U, 48U}) {
    expect_error([&] { HierarchicalOperator(storage_with(begin, 16)); },
                 "within the coefficients of a cluster basis");
  }
}

std::vector<float> expansion(const HierarchicalOperator& op) {
  std::vector<float> y(op.patch_count() * op.patch_count());
  op.expand(0, y);
  return y;
}

TEST(EquilibratedOperator, IsWhatItHoldsTimesTheScalesOfBothPatches) {
  const HierarchicalStorage plain = random_nested_storage(500, 3, 21);
  const HierarchicalStorage scaled = test::equilibrated(plain, 22);
  std::vector<float> scale(500);
  for (std::size_t k = 0; k < scale.size(); ++k) {
    scale[plain.patch[k]] = std::exp2(static_cast<float>(scaled.scale_exponent[k]));
  }
  const std::vector<float> before = expansion(HierarchicalOperator(plain));
  std::vector<float> expected = before;
  for (std::size_t i = 0; i < 500; ++i) {
    for (std::size_t j = 0; j < 500; ++j) expected[i * 500 + j] *= scale[i] * scale[j];
  }
  EXPECT_EQ(expansion(HierarchicalOperator(scaled)), expected);
  EXPECT_NE(before, expected);
}

TEST(EquilibratedOperator, FitsHalvesByItsScales) {
  constexpr std::uint32_t kSize = 32;
  HierarchicalStorage storage = storage_without_blocks(kSize);
  storage.blocks.push_back({.row_count = kSize, .column_count = kSize});
  std::vector<float> values(kSize * kSize + HierarchicalFormat::kPadding);
  for (std::uint32_t i = 0; i < kSize; ++i) {
    for (std::uint32_t j = 0; j < kSize; ++j) {
      values[i * kSize + j] = static_cast<float>(1000 + i * j);  // x 512 is too much
    }
  }
  storage.values_f32 = SharedArray(std::move(values));
  for (const Precision precision : {Precision::kF16, Precision::kQ8}) {
    expect_error([&] { encode_values(storage, precision); }, "too large for f16");
  }
  storage.scale_exponent.assign(kSize, -3);
  const HierarchicalOperator exact(storage);
  const std::vector<Float3> m0 = test::random_light(kSize, 24, 100);
  for (const Precision precision : {Precision::kF16, Precision::kQ8}) {
    const HierarchicalOperator op(encode_values(storage, precision));
    EXPECT_GT(op.storage().scale_exponent.front(), -3);
    EXPECT_LT(
        relative_difference(unaided_product(op, m0), unaided_product(exact, m0), storage.area),
        1e-3);
  }
}

}  // namespace
}  // namespace rebounce::test_nested_operator
