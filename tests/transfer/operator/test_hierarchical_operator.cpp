#include "transfer/operator/hierarchical_operator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "rebounce/error.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/random_light.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/half_float.h"
#include "transfer/format/hierarchical_encoding.h"
#include "transfer/kernels/kernels.h"

namespace rebounce {
namespace {

using test::expect_error;
using test::random_hierarchical_storage;
using test::random_nested_storage;

std::vector<Float3> product(const TransferOperator& op, const std::vector<Float3>& m0) {
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  op.apply(m0, h, workspace);
  return h;
}

/// Y M0 by plain sums in double precision over the operator's own expansion.
std::vector<Float3> multiply_expansion(const TransferOperator& op, const std::vector<Float3>& m0) {
  const std::size_t n = m0.size();
  std::vector<float> y(n * n);
  std::vector<Float3> h(n);
  for (int c = 0; c < kChannelCount; ++c) {
    op.expand(c, y);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += static_cast<double>(y[i * n + j]) * m0[j][c];
      h[i][c] = static_cast<float>(sum);
    }
  }
  return h;
}

TEST(HierarchicalOperator, MultipliesLikeItsExpansion) {
  for (const std::size_t n : {1U, 15U, 16U, 17U, 100U, 333U, 1000U}) {
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      const HierarchicalOperator op(random_hierarchical_storage(n, matrices, 7 * n + matrices));
      const std::vector<Float3> m0 = test::random_light(n, n, 100);
      EXPECT_LT(relative_difference(product(op, m0), multiply_expansion(op, m0), op.storage().area),
                2e-6)
          << n << " patches, " << matrices << " matrices";
    }
  }
}

TEST(HierarchicalOperator, TheTestOperatorHasBlocksOfAllKinds) {
  int dense = 0, low_rank = 0, zero = 0, dense_diagonal = 0, low_rank_diagonal = 0;
  for (const TransferBlock& block : random_hierarchical_storage(1000, 3, 7003).blocks) {
    const bool is_dense = block.kind == TransferBlock::Kind::kDense;
    (block.on_diagonal() ? (is_dense ? dense_diagonal : low_rank_diagonal)
                         : (is_dense ? dense : low_rank))++;
    if (!is_dense && block.row_rank == 0) ++zero;
  }
  for (const int count : {dense, low_rank, zero, dense_diagonal, low_rank_diagonal}) {
    EXPECT_GT(count, 3);
  }
}

TEST(HierarchicalOperator, ExpansionIsSymmetricInTheAreaNorm) {
  const HierarchicalOperator op(random_hierarchical_storage(200, 3, 4));
  const std::vector<float>& area = op.storage().area;
  std::vector<float> y(200 * 200);
  op.expand(1, y);
  for (std::size_t i = 0; i < 200; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const float a = area[i] * y[i * 200 + j], b = area[j] * y[j * 200 + i];
      EXPECT_NEAR(a, b, 1e-6 + 1e-5 * std::abs(a));
    }
  }
}

TEST(HierarchicalOperator, HalfPrecisionIsAsGoodAsItsBits) {
  const HierarchicalStorage storage = random_hierarchical_storage(500, 3, 5);
  const HierarchicalOperator exact(storage);
  const HierarchicalOperator half(encode_values(storage, Precision::kF16));
  EXPECT_EQ(2 * half.storage().values_f16.size_bytes(), exact.storage().values_f32.size_bytes());
  const std::vector<Float3> m0 = test::random_light(500, 1, 100);
  const std::vector<float>& area = storage.area;
  EXPECT_LT(relative_difference(product(half, m0), multiply_expansion(half, m0), area), 2e-6);
  const double error = relative_difference(product(half, m0), product(exact, m0), area);
  EXPECT_LT(error, 1e-3);  // 11 bits per value, three factors to an entry
  EXPECT_GT(error, 0);
}

TEST(HierarchicalOperator, BytesAreAsGoodAsTheirBits) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const HierarchicalStorage storage = random_hierarchical_storage(500, matrices, 5);
    const HierarchicalOperator exact(storage);
    const HierarchicalOperator bytes(encode_values(storage, Precision::kQ8));
    EXPECT_LT(bytes.bytes(), exact.bytes() / 2);
    const std::vector<Float3> m0 = test::random_light(500, 1, 100);
    const std::vector<float>& area = storage.area;
    // Light is rounded to 15 bits on its way, twice.
    EXPECT_LT(relative_difference(product(bytes, m0), multiply_expansion(bytes, m0), area), 5e-5);
    const double error = relative_difference(product(bytes, m0), product(exact, m0), area);
    EXPECT_LT(error, 5e-3);  // 7 bits per value of a basis, two of them to an entry
    EXPECT_GT(error, 1e-5);
  }
}

TEST(HierarchicalOperator, ShortsAreAsGoodAsTheirBits) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const HierarchicalStorage storage = random_hierarchical_storage(500, matrices, 5);
    const HierarchicalOperator exact(storage);
    const HierarchicalOperator shorts(encode_values(storage, Precision::kQ16));
    EXPECT_LT(shorts.bytes(), exact.bytes());
    const std::vector<Float3> m0 = test::random_light(500, 1, 100);
    const std::vector<float>& area = storage.area;
    // Light is rounded to 11 or 12 bits on its way, twice.
    EXPECT_LT(relative_difference(product(shorts, m0), multiply_expansion(shorts, m0), area), 5e-4);
    const double error = relative_difference(product(shorts, m0), product(exact, m0), area);
    EXPECT_LT(error, 1e-3);
    EXPECT_GT(error, 0);
  }
}

TEST(HierarchicalOperator, RefusesToRoundTwice) {
  const HierarchicalStorage exact = random_hierarchical_storage(100, 1, 1);
  for (const Precision first : {Precision::kF16, Precision::kQ16, Precision::kQ8}) {
    const HierarchicalStorage rounded = encode_values(exact, first);
    for (const Precision second :
         {Precision::kF32, Precision::kF16, Precision::kQ16, Precision::kQ8}) {
      EXPECT_THROW(encode_values(rounded, second), Error)
          << precision_name(first) << " to " << precision_name(second);
    }
  }
}

TEST(HierarchicalOperator, RefusesShortsWhoseSumsCouldOverflow) {
  HierarchicalStorage storage =
      encode_values(random_hierarchical_storage(100, 1, 1), Precision::kQ16);
  std::vector<std::int16_t> bases(storage.bases_q16.begin(), storage.bases_q16.end());
  for (const std::int16_t value : {4096, -4096, -32768}) {
    bases[7] = value;
    storage.bases_q16 = SharedArray(std::vector<std::int16_t>(bases));
    expect_error([&] { HierarchicalOperator op(storage); }, "beyond +-4095");
  }
}

TEST(HierarchicalOperator, SameBitsForAnyNumberOfThreads) {
  const HierarchicalStorage storage = random_hierarchical_storage(777, 3, 6);
  const std::vector<Float3> m0 = test::random_light(777, 2, 100);
  for (const Precision precision : {Precision::kF32, Precision::kQ16, Precision::kQ8}) {
    const HierarchicalOperator op(encode_values(storage, precision));
    const auto multiply = [&] { return product(op, m0); };
    EXPECT_EQ(test::with_threads(1, multiply), test::with_threads(5, multiply));
  }
}

std::vector<Float3> batch_product(const TransferOperator& op, std::size_t lights,
                                  const std::vector<Float3>& m0) {
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.batch_workspace_size(lights), std::nanf(""));
  op.apply_batch(lights, m0, h, workspace);
  return h;
}

void check_batch(const HierarchicalOperator& op, std::size_t lights) {
  const std::size_t n = op.patch_count();
  const std::vector<Float3> m0 = test::random_light(lights * n, lights, 100);
  const std::vector<Float3> batch = batch_product(op, lights, m0);
  for (std::size_t light = 0; light < lights; ++light) {
    const auto at = static_cast<std::ptrdiff_t>(light * n);
    const auto end = at + static_cast<std::ptrdiff_t>(n);
    const std::vector<Float3> one(m0.begin() + at, m0.begin() + end);
    const std::vector<Float3> part(batch.begin() + at, batch.begin() + end);
    EXPECT_LT(relative_difference(part, product(op, one), op.storage().area), 1e-6);
  }
}

TEST(HierarchicalOperator, ABatchIsAsManyApplies) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const HierarchicalStorage storage = random_hierarchical_storage(333, matrices, 40 + matrices);
    for (const HierarchicalOperator& op :
         {HierarchicalOperator(storage),
          HierarchicalOperator(encode_values(storage, Precision::kF16)),
          HierarchicalOperator(encode_values(storage, Precision::kQ16))}) {
      for (const std::size_t lights : {1U, 2U, 3U, 5U}) check_batch(op, lights);
    }
  }
}

/// Light at the receivers differs by `allowed` of the largest at most.
void check_receivers(const HierarchicalOperator& op, float allowed) {
  const std::size_t n = op.patch_count();
  const std::vector<Float3> m0 = test::random_light(n, 4, 100), whole = product(op, m0);
  float most = 0;
  for (const Float3& h : whole)
    most = std::max({most, std::abs(h[0]), std::abs(h[1]), std::abs(h[2])});
  std::vector<float> workspace(op.workspace_size(), std::nanf(""));
  constexpr Float3 kUnset = {-1, -2, -3};
  std::uint64_t previous = 0;
  for (const std::size_t count : {0U, 1U, 40U, 400U, 777U}) {
    // Neighbours in the order of the clusters, like the patches of a room.
    const std::vector<std::uint32_t> patches(
        op.storage().patch.begin() + static_cast<std::ptrdiff_t>((n - count) / 2),
        op.storage().patch.begin() + static_cast<std::ptrdiff_t>((n - count) / 2 + count));
    const HierarchicalOperator::Receivers receivers = op.receivers(patches);
    std::vector<Float3> h(n, kUnset);
    op.apply_to(receivers, m0, h, workspace);
    EXPECT_THROW(op.apply_to(receivers, m0, h, std::span(workspace).subspan(1)), Error);
    EXPECT_THROW(op.apply_to(receivers, m0, std::span(h).subspan(1), workspace), Error);
    std::vector<Float3> expected(n, kUnset);
    for (const std::uint32_t p : patches) expected[p] = whole[p];
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        const bool untouched = expected[i] == kUnset;
        EXPECT_NEAR(h[i][c], expected[i][c], untouched ? 0 : allowed * most);
      }
    }
    EXPECT_TRUE(receivers.value_count() > previous || count == 0);
    previous = receivers.value_count();
  }
  EXPECT_EQ(op.receivers(std::vector<std::uint32_t>{}).value_count(), 0U);
  expect_error(
      [&] { (void)op.receivers(std::vector<std::uint32_t>{static_cast<std::uint32_t>(n)}); },
      "does not exist");
}

TEST(HierarchicalOperator, ReceiversGetWhatAnApplyGivesThemAndNothingElseIsTouched) {
  const HierarchicalStorage storage = random_hierarchical_storage(777, 3, 12);
  check_receivers(HierarchicalOperator(storage), 1e-6F);
  // Coefficients are rounded by the largest of those that are wanted.
  check_receivers(HierarchicalOperator(encode_values(storage, Precision::kQ16)), 5e-4F);
}

TEST(HierarchicalOperator, TheOrderOfTheValuesMakesNoDifference) {
  const HierarchicalStorage by_block = random_hierarchical_storage(500, 2, 9);
  const HierarchicalStorage streamed = stream_values(by_block);
  const std::vector<Float3> m0 = test::random_light(500, 5, 100);
  EXPECT_EQ(streamed.order, HierarchicalStorage::Order::kStreamed);
  EXPECT_EQ(streamed.values_f32.size() % 64, 0U);
  EXPECT_EQ(product(HierarchicalOperator(by_block), m0),
            product(HierarchicalOperator(streamed), m0));
}

TEST(HierarchicalOperator, AllocatesNothing) {
  const HierarchicalOperator op(random_hierarchical_storage(500, 3, 8));
  const std::vector<Float3> m0 = test::random_light(500, 3, 100);
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size());
  op.apply(m0, h, workspace);
  EXPECT_EQ(test::count_allocations([&] { op.apply(m0, h, workspace); }), 0);
  const HierarchicalOperator::Receivers receivers = op.receivers(std::vector<std::uint32_t>{1, 7});
  EXPECT_EQ(test::count_allocations([&] { op.apply_to(receivers, m0, h, workspace); }), 0);
  EXPECT_GT(test::count_allocations([&] { h.reserve(2 * h.size()); }), 0)
      << "allocations are counted";
}

TEST(HierarchicalOperator, RefusesStorageThatDoesNotFit) {
  using Storage = HierarchicalStorage;
  using Kind = TransferBlock::Kind;
  struct Fault {
    const char* message;
    std::function<void(Storage&)> make;
  };
  const std::vector<Fault> faults = {
      {"no patches", [](Storage& s) { s.area.clear(), s.patch.clear(), s.blocks.clear(); }},
      {"matrices is not 1, 2 or 3", [](Storage& s) { s.matrix_count = 0; }},
      {"matrices is not 1, 2 or 3", [](Storage& s) { s.matrix_count = 4; }},
      {"has no matrix", [](Storage& s) { s.channel_matrix[1] = 3; }},
      {"not one position", [](Storage& s) { s.patch.pop_back(); }},
      {"not a permutation", [](Storage& s) { s.patch[3] = s.patch[4]; }},
      {"not a permutation", [](Storage& s) { s.patch[3] = 100; }},
      {"reaches outside", [](Storage& s) { s.blocks[0].row_begin = 112; }},
      {"reaches outside", [](Storage& s) { s.blocks[0].column_begin = 4294967280U; }},
      {"reaches outside", [](Storage& s) { s.blocks[0].row_count = 4294967280U; }},
      {"empty", [](Storage& s) { s.blocks[0].row_count = 0; }},
      {"not aligned", [](Storage& s) { s.blocks[0].row_count = 8; }},
      {"nor below", [](Storage& s) { s.blocks[0].column_begin = 16; }},
      {"nor below", [](Storage& s) { s.blocks[0].column_count += 16; }},
      {"unknown kind", [](Storage& s) { s.blocks[0].kind = static_cast<Kind>(3); }},
      {"dense block has a rank",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kDense;
         s.blocks[0].row_rank = 1;
       }},
      {"ranks",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kLowRank;
         s.blocks[0].row_rank = s.blocks[0].column_rank = 200;
       }},
      {"ranks",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kLowRank;
         s.blocks[0].row_rank = 1;
         s.blocks[0].column_rank = 2;
       }},
      {"dense block has a rank",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kDense;
         s.blocks[0].row_residual_rank = 1;
       }},
      {"residual ranks of a block",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kLowRank;
         s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
         s.blocks[0].row_residual_rank = s.blocks[0].column_residual_rank = 3;
       }},
      {"residual ranks of a block",
       [](Storage& s) {
         s.blocks[0].kind = Kind::kLowRank;
         s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
         s.blocks[0].row_residual_rank = 1;
         s.blocks[0].column_residual_rank = 0;
       }},
      {"not in 8 bits",
       [](Storage& s) {
         s.precision = hierarchical_precision(Precision::kF16);
         s.blocks[0].kind = Kind::kLowRank;
         s.blocks[0].row_rank = s.blocks[0].column_rank = 2;
         s.blocks[0].row_residual_rank = s.blocks[0].column_residual_rank = 1;
       }},
      {"cannot be combined", [](Storage& s) { s.precision.couplings = CouplingPrecision::kF16; }},
      {"number of values", [](Storage& s) { s.blocks.pop_back(); }},
      {"number of values", [](Storage& s) { s.order = HierarchicalStorage::Order::kStreamed; }},
      {"number of values",
       [](Storage& s) {
         s.precision = hierarchical_precision(Precision::kF16);
         for (TransferBlock& block : s.blocks)
           block.row_residual_rank = block.column_residual_rank = 0;
       }},
  };
  for (std::size_t k = 0; k < faults.size(); ++k) {
    SCOPED_TRACE("fault " + std::to_string(k) + ": " + faults[k].message);
    Storage storage = random_hierarchical_storage(100, 3, 1);
    ASSERT_TRUE(storage.blocks[0].on_diagonal());
    faults[k].make(storage);
    expect_error([&] { HierarchicalOperator{storage}; }, faults[k].message);
  }
}

constexpr Precision kPrecisions[] = {Precision::kF32, Precision::kF16, Precision::kQ16,
                                     Precision::kQ8};

/// What an apply may differ from plain sums over the same stored values.
double rounding_of(Precision precision) {
  return precision == Precision::kQ16 ? 5e-4 : precision == Precision::kQ8 ? 1e-4 : 5e-6;
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

TEST(NestedOperator, MultipliesLikeItsExpansionInEveryPrecision) {
  for (const std::size_t n : {64U, 500U, 1000U}) {
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      const HierarchicalStorage storage = random_nested_storage(n, matrices, n + matrices);
      ASSERT_FALSE(storage.coefficient_scale.empty());
      const std::vector<Float3> m0 = test::random_light(n, n, 100);
      const HierarchicalOperator exact(storage);
      for (const Precision precision : kPrecisions) {
        SCOPED_TRACE(std::to_string(n) + " patches, " + std::to_string(matrices) + " matrices");
        const HierarchicalOperator op(encode_values(storage, precision));
        EXPECT_LT(relative_difference(product(op, m0), multiply_expansion(op, m0), storage.area),
                  rounding_of(precision));
        EXPECT_LT(relative_difference(product(op, m0), product(exact, m0), storage.area), 5e-3);
      }
    }
  }
}

TEST(NestedOperator, ClusterBasesAreTheProductsThatTheyStandFor) {
  // One block of rank one over the cluster coefficients of all positions but its own mirror
  // image's: Yhat = u v^T + v u^T with u = W D t and v = W D s, written out.
  HierarchicalStorage storage;
  storage.area.assign(64, 1.0F);
  storage.patch.resize(64);
  std::iota(storage.patch.begin(), storage.patch.end(), 0U);
  storage.matrix_count = 1;
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

TEST(NestedOperator, SameBitsForAnyNumberOfThreads) {
  const HierarchicalStorage storage = random_nested_storage(1000, 3, 6);
  const std::vector<Float3> m0 = test::random_light(1000, 2, 100);
  for (const Precision precision : kPrecisions) {
    const HierarchicalOperator op(encode_values(storage, precision));
    const auto multiply = [&] { return product(op, m0); };
    EXPECT_EQ(test::with_threads(1, multiply), test::with_threads(5, multiply));
  }
}

TEST(NestedOperator, ABatchIsAsManyAppliesAndReceiversGetTheirLight) {
  const HierarchicalStorage storage = random_nested_storage(1000, 3, 11);
  for (const Precision precision : kPrecisions) {
    check_batch(HierarchicalOperator(encode_values(storage, precision)), 3);
  }
  check_receivers(HierarchicalOperator(random_nested_storage(777, 3, 12)), 1e-6F);
  check_receivers(HierarchicalOperator(random_nested_storage(1000, 3, 12)), 1e-6F);
  check_receivers(HierarchicalOperator(encode_values(storage, Precision::kQ8)), 5e-4F);
}

TEST(NestedOperator, AllocatesNothing) {
  const HierarchicalOperator op(random_nested_storage(500, 3, 8));
  const std::vector<Float3> m0 = test::random_light(500, 3, 100);
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size());
  op.apply(m0, h, workspace);
  EXPECT_EQ(test::count_allocations([&] { op.apply(m0, h, workspace); }), 0);
}

TEST(NestedOperator, RefusesClusterBasesThatDoNotFit) {
  using Storage = HierarchicalStorage;
  struct Fault {
    const char* message;
    std::function<void(Storage&)> make;
  };
  const std::vector<Fault> faults = {
      {"not numbered in the order", [](Storage& s) { s.blocks[1].column_begin += 16; }},
      {"not numbered in the order", [](Storage& s) { std::swap(s.blocks[0], s.blocks[1]); }},
      {"not numbered in the order", [](Storage& s) { s.blocks[0].column_count = 4294967295U; }},
      {"a cluster basis is not over positions", [](Storage& s) { s.blocks[0].row_begin = 1008; }},
      {"a cluster basis is not over positions", [](Storage& s) { s.blocks[0].row_count = 24; }},
      {"rank of a cluster basis", [](Storage& s) { s.blocks[0].row_rank = 4; }},
      {"rank of a cluster basis", [](Storage& s) { s.blocks[0].column_rank = 1; }},
      {"rank of a cluster basis", [](Storage& s) { s.blocks[0].row_residual_rank = 6; }},
      {"rank of a cluster basis", [](Storage& s) { s.blocks[0].column_residual_rank = 1; }},
      {"one scale for each cluster coefficient",
       [](Storage& s) { s.coefficient_scale.pop_back(); }},
      {"one scale for each cluster coefficient",
       [](Storage& s) { s.coefficient_scale.push_back(1); }},
      {"not finite", [](Storage& s) { s.coefficient_scale[3] = std::nanf(""); }},
      {"reaches outside",
       [](Storage& s) {
         for (TransferBlock& block : s.blocks) {
           if (block.kind != TransferBlock::Kind::kDense) continue;
           block.row_begin = block.column_begin = 1008;
           break;
         }
       }},
      {"reaches outside",
       [](Storage& s) {
         for (TransferBlock& block : s.blocks) {
           if (block.kind == TransferBlock::Kind::kLowRank) block.row_begin = 1008 - 16;
         }
       }},
      {"number of values", [](Storage& s) { s.blocks.pop_back(); }},
  };
  for (std::size_t k = 0; k < faults.size(); ++k) {
    SCOPED_TRACE("fault " + std::to_string(k) + ": " + faults[k].message);
    Storage storage = random_nested_storage(1000, 3, 1);
    faults[k].make(storage);
    expect_error([&] { HierarchicalOperator{storage}; }, faults[k].message);
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

TEST(EquilibratedOperator, MultipliesLikeItsExpansionInEveryPrecision) {
  for (const std::size_t n : {777U, 1000U}) {
    const HierarchicalStorage storage = test::equilibrated(random_nested_storage(n, 3, n), n + 1);
    const std::vector<Float3> m0 = test::random_light(n, n, 100);
    for (const Precision precision : kPrecisions) {
      SCOPED_TRACE(std::to_string(n) + " patches, " + precision_name(precision));
      const HierarchicalOperator op(encode_values(storage, precision));
      EXPECT_LT(relative_difference(product(op, m0), multiply_expansion(op, m0), storage.area),
                rounding_of(precision));
      check_batch(op, 3);
    }
    check_receivers(HierarchicalOperator(storage), 1e-6F);
  }
}

TEST(EquilibratedOperator, FitsHalvesByItsScales) {
  constexpr std::uint32_t kSize = 32;
  HierarchicalStorage storage;
  storage.area.assign(kSize, 1.0F);
  storage.patch.resize(kSize);
  std::iota(storage.patch.begin(), storage.patch.end(), 0U);
  storage.matrix_count = 1;
  storage.blocks.push_back({.row_count = kSize, .column_count = kSize});
  std::vector<float> values(kSize * kSize + HierarchicalFormat::kPadding);
  for (std::uint32_t i = 0; i < kSize; ++i) {
    for (std::uint32_t j = 0; j < kSize; ++j) {
      values[i * kSize + j] = static_cast<float>(1000 + i * j);  // x 512 is too much
    }
  }
  storage.values_f32 = SharedArray(std::move(values));
  for (const Precision precision : {Precision::kF16, Precision::kQ16, Precision::kQ8}) {
    expect_error([&] { encode_values(storage, precision); }, "too large for f16");
  }
  storage.scale_exponent.assign(kSize, -3);
  const HierarchicalOperator exact(storage);
  const std::vector<Float3> m0 = test::random_light(kSize, 24, 100);
  for (const Precision precision : {Precision::kF16, Precision::kQ16, Precision::kQ8}) {
    const HierarchicalOperator op(encode_values(storage, precision));
    EXPECT_GT(op.storage().scale_exponent.front(), -3);
    EXPECT_LT(relative_difference(product(op, m0), product(exact, m0), storage.area), 1e-3);
  }
}

TEST(EquilibratedOperator, RefusesScalesThatDoNotFit) {
  HierarchicalStorage storage = random_hierarchical_storage(100, 1, 1);
  storage.scale_exponent.assign(99, 0);
  expect_error([&] { HierarchicalOperator{storage}; }, "one scale for each position");
  storage.scale_exponent.assign(100, 0);
  for (const std::int8_t exponent : {25, -25, 127, -128}) {
    storage.scale_exponent[7] = exponent;
    expect_error([&] { HierarchicalOperator{storage}; }, "beyond 2^+-24");
  }
}

TEST(HierarchicalOperator, RefusesHalfPrecisionBeyondItsRange) {
  HierarchicalStorage storage = random_hierarchical_storage(100, 1, 1);
  storage.values_f32 =
      SharedArray(std::vector<float>(storage.values_f32.size(), 130.0F));  // x 512 is too much
  expect_error([&] { encode_values(storage, Precision::kF16); }, "too large for f16");
}

/// Vectors and matrices with random entries that half precision holds exactly.
struct Random {
  std::mt19937 engine{3};
  std::vector<float> floats(std::size_t size) {
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> values(size);
    for (float& v : values) v = half_to_float(float_to_half(uniform(engine)));
    return values;
  }
};

std::vector<std::uint16_t> to_half(const std::vector<float>& values) {
  std::vector<std::uint16_t> half(values.size());
  std::ranges::transform(values, half.begin(), float_to_half);
  return half;
}

// Relative to sums of up to 96 products of numbers below 1.
constexpr double kAllowed = 1e-5;

// What a kernel must not touch keeps this value.
constexpr float kUntouched = -1234;

PlanarVectors<const float> planar(const std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}
PlanarVectors<float> planar(std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}

template <typename T>
Coefficients<T> side_by_side(std::vector<std::remove_const_t<T>>& data, std::size_t lights) {
  return {data.data(), data.size() / lights};
}

/// A basis of plain numbers [rank][size], and how far products with it may be off.
struct PlainBasis {
  std::vector<float> value;
  std::size_t rank, size;
  double allowed;
};

constexpr std::size_t kStride = 330, kRankStride = 150, kFirstPosition = 16, kFirstCoefficient = 4;

/// Where coefficient r of vector v is.
std::size_t coefficient_at(std::size_t v, std::size_t r) {
  return (v / 3 * kRankStride + kFirstCoefficient + r) * kChannelLanes + v % 3;
}

/// Ranks from `first_rank` on and the last `places` positions of a cluster.
BasisPart part_of(const PlainBasis& plain, std::size_t first_rank, std::size_t places) {
  const auto rank = static_cast<std::uint32_t>(plain.rank);
  const auto size = static_cast<std::uint32_t>(plain.size);
  return {.values = 0,
          .rank = rank,
          .size = size,
          .coefficient = kFirstCoefficient,
          .position = kFirstPosition,
          .first_rank = static_cast<std::uint32_t>(first_rank),
          .last_rank = rank,
          .first_offset = size - static_cast<std::uint32_t>(places),
          .last_offset = size};
}

template <typename Value>
void check_project(const BasisKernels<Value>& kernels, const std::vector<Value>& basis,
                   const PlainBasis& plain, std::size_t written, std::size_t lights) {
  Random random;
  const std::vector<float> x = random.floats(3 * lights * kStride);
  std::vector<float> sent(lights * kRankStride * kChannelLanes, kUntouched);
  const BasisPart part = part_of(plain, 0, plain.size);
  kernels.project(basis.data(), {&part, 1}, planar(x, 3 * lights),
                  side_by_side<float>(sent, lights));
  for (std::size_t v = 0; v < 3 * lights; ++v) {
    for (std::size_t r = 0; r < kRankStride - kFirstCoefficient; ++r) {
      double expected = r < written ? 0 : kUntouched;
      for (std::size_t k = 0; k < plain.size && r < plain.rank; ++k) {
        expected += plain.value[r * plain.size + k] * x[v * kStride + kFirstPosition + k];
      }
      EXPECT_NEAR(sent[coefficient_at(v, r)], expected, plain.allowed);
    }
  }
}

template <typename Value>
void check_expand(const BasisKernels<Value>& kernels, const std::vector<Value>& basis,
                  const PlainBasis& plain, std::size_t first_rank, std::size_t places,
                  std::size_t lights) {
  Random random;
  const std::vector<float> y = random.floats(3 * lights * kStride);
  std::vector<float> arrived = random.floats(lights * kRankStride * kChannelLanes), sum = y;
  const BasisPart part = part_of(plain, first_rank, places);
  kernels.expand(basis.data(), {&part, 1}, side_by_side<const float>(arrived, lights),
                 planar(sum, 3 * lights));
  for (std::size_t v = 0; v < 3 * lights; ++v) {
    for (std::size_t k = 0; k < kStride; ++k) {
      double expected = y[v * kStride + k];
      const bool reached =
          k >= kFirstPosition + part.first_offset && k < kFirstPosition + part.last_offset;
      for (std::size_t r = first_rank; r < plain.rank && reached; ++r) {
        expected +=
            plain.value[r * plain.size + k - kFirstPosition] * arrived[coefficient_at(v, r)];
      }
      EXPECT_NEAR(sum[v * kStride + k], expected, plain.allowed);
    }
  }
}

template <typename Value>
void check_bases(const BasisKernels<Value>& kernels, const std::vector<Value>& basis,
                 const PlainBasis& plain, std::size_t lights) {
  check_project(kernels, basis, plain, plain.rank, lights);
  for (std::size_t places = 16; places <= plain.size; places += 16) {
    check_expand(kernels, basis, plain, 0, places, lights);
  }
  if (plain.rank > 1) check_expand(kernels, basis, plain, 1, plain.size, lights);
}

/// A basis in the order of the file: strips of 64 positions, groups of four ranks, pairs of
/// positions.
template <typename Value>
std::vector<Value> in_strips(const PlainBasis& plain) {
  std::vector<Value> values;
  for (std::size_t strip = 0; strip < plain.size; strip += 64) {
    for (std::size_t group = 0; group < plain.rank; group += 4) {
      for (std::size_t k = strip; k < std::min(strip + 64, plain.size); k += 2) {
        for (std::size_t r = group; r < group + 4; ++r) {
          for (std::size_t i = k; i < k + 2; ++i) {
            const float value = r < plain.rank ? plain.value[r * plain.size + i] : 0;
            values.push_back(static_cast<Value>(value));
          }
        }
      }
    }
  }
  return values;
}

template <typename Value>
constexpr float kLargestInteger = 127;
template <>
constexpr float kLargestInteger<std::int16_t> = HierarchicalFormat::kLargestShort;

/// Integers up to the largest.
template <typename Value>
PlainBasis integer_basis(std::size_t rank, std::size_t size) {
  constexpr float kLargest = kLargestInteger<Value>;
  // Light up to 1 is a multiple of this at most.
  constexpr double kLightStep = std::is_same_v<Value, std::int16_t> ? 0x1p-11 : 0x1p-14;
  Random random;
  PlainBasis plain{random.floats(rank * size), rank, size, 0};
  for (float& value : plain.value) value = std::round(kLargest * value);
  plain.value.front() = -kLargest;
  plain.allowed = kLightStep / 2 * kLargest * static_cast<double>(std::max(rank, size));
  return plain;
}

template <typename Value>
void check_integer_bases(const BasisKernels<Value>& kernels, std::size_t rank, std::size_t size,
                         std::size_t lights) {
  const PlainBasis plain = integer_basis<Value>(rank, size);
  const std::vector<Value> basis = in_strips<Value>(plain);
  check_project(kernels, basis, plain, (rank + 3) / 4 * 4, lights);
  for (std::size_t places = 16; places <= size; places += 16) {
    for (std::size_t first = 0; first < std::min<std::size_t>(6, rank); ++first) {
      check_expand(kernels, basis, plain, first, places, lights);
    }
  }
}

/// Products that are written over what they are of are the same.
template <typename Value>
void check_in_place(CouplingKernel<Value> multiply_couplings, const std::vector<Value>& values,
                    const CouplingBlock& coupling, const ChannelLanes& lanes, std::size_t lights,
                    const std::vector<float>& in, const std::vector<float>& out) {
  std::vector<float> both = in, scratch(scratch_size(coupling.rows, coupling.columns));
  const std::size_t stride = in.size() / lights;
  multiply_couplings(values.data(), {&coupling, 1}, lanes, lights, {both.data(), stride},
                     {both.data(), stride}, scratch.data());
  for (std::size_t k = 0; k < both.size(); ++k) {
    EXPECT_EQ(both[k], out[k] == kUntouched ? in[k] : out[k]) << k;
  }
}

template <typename Value>
void check_coupling(CouplingKernel<Value> multiply_couplings, const std::vector<Value>& values,
                    const std::vector<float>& plain, std::uint32_t rows, std::uint32_t columns,
                    std::size_t lights, std::uint32_t matrices = 2) {
  using Direction = CouplingBlock::Direction;
  constexpr std::uint32_t kRow = 3, kColumn = 99, kEnd = 200;
  const std::uint32_t last = matrices - 1;
  const std::array<std::uint32_t, 3> matrix{last, 0, last};
  Random random;
  std::vector<float> in = random.floats(lights * kEnd * kChannelLanes);
  const ChannelLanes lanes(matrix, matrices);
  for (const Direction direction : {Direction::kBoth, Direction::kToRows, Direction::kToColumns}) {
    const CouplingBlock coupling{8, rows, columns, kRow, kColumn, direction};
    std::vector<float> out(lights * kEnd * kChannelLanes, kUntouched);
    std::vector<float> scratch(scratch_size(rows, columns));
    multiply_couplings(values.data(), {&coupling, 1}, lanes, lights,
                       {in.data(), kEnd * kChannelLanes}, {out.data(), kEnd * kChannelLanes},
                       scratch.data());
    check_in_place(multiply_couplings, values, coupling, lanes, lights, in, out);
    for (std::size_t v = 0; v < 3 * lights; ++v) {
      const auto at = [v](std::size_t k) { return (v / 3 * kEnd + k) * kChannelLanes + v % 3; };
      const auto entry = [&](std::size_t i, std::size_t j) {
        return plain[8 + (i * columns + j) * matrices + matrix[v % 3]];
      };
      for (std::uint32_t k = 0; k < kEnd; ++k) {
        double expected = kUntouched;
        if (direction != Direction::kToColumns && k >= kRow && k < kRow + rows) {
          expected = 0;
          for (std::uint32_t j = 0; j < columns; ++j) {
            expected += entry(k - kRow, j) * in[at(kColumn + j)];
          }
        }
        if (direction != Direction::kToRows && k >= kColumn && k < kColumn + columns) {
          expected = 0;
          for (std::uint32_t i = 0; i < rows; ++i) {
            expected += entry(i, k - kColumn) * in[at(kRow + i)];
          }
        }
        EXPECT_NEAR(out[at(k)], expected, kAllowed);
      }
    }
  }
}

/// A dense block between its products: those that are put in places of coefficients, their ends
/// added to light, and those that are added to light at once.
template <typename Value>
class DenseCheck {
 public:
  DenseCheck(const CouplingKernels<Value>& kernels, const std::vector<Value>& values,
             std::span<const float> plain, std::size_t lights)
      : kernels_(kernels), values_(values), plain_(plain.subspan(kFirst)), lights_(lights) {
    Random random;
    x_ = random.floats(3 * lights * kEnd);
    y_ = random.floats(3 * lights * kEnd);
  }

  void check(std::uint32_t rows, std::uint32_t columns, DenseBlock::Direction direction) {
    const DenseBlock block{kFirst, rows, columns, kRow, kColumn, kRowOut, kColumnOut, direction};
    std::vector<float> out(lights_ * kFloats, kUntouched);
    kernels_.multiply_dense(values_.data(), {&block, 1}, x(), {out.data(), kFloats});
    std::vector<float> expected = out, sum = y_, ends = y_, at_once = y_;
    for (std::size_t v = 0; v < 3 * lights_; ++v) {
      const float* const light = x_.data() + v * kEnd;
      float* const of_light = expected.data() + v / 3 * kFloats;
      for (std::uint32_t i = 0; i < rows && direction != Direction::kToColumns; ++i) {
        float product = 0;
        for (std::uint32_t j = 0; j < columns; ++j) {
          product += plain_[i * columns + j] * light[kColumn + j];
        }
        of_light[kRowOut * kChannelLanes + v % 3 * rows + i] = product;
        sum[v * kEnd + kRow + i] += 0.25F * product;
      }
      for (std::uint32_t j = 0; j < columns && direction != Direction::kToRows; ++j) {
        float product = 0;
        for (std::uint32_t i = 0; i < rows; ++i) {
          product += plain_[i * columns + j] * light[kRow + i];
        }
        of_light[kColumnOut * kChannelLanes + v % 3 * columns + j] = product;
        sum[v * kEnd + kColumn + j] += 0.25F * product;
      }
    }
    expect_near(out, expected);
    // An end in two parts, as where positions are cut.
    std::vector<DenseEnd> all_ends;
    if (direction != Direction::kToColumns) all_ends.push_back({kRow, rows, kRowOut, 0, rows});
    if (direction != Direction::kToRows) {
      all_ends.push_back({kColumn, 16, kColumnOut, 0, columns});
      if (columns > 16) {
        all_ends.push_back({kColumn + 16, columns - 16, kColumnOut, 16, columns});
      }
    }
    kernels_.add_products(all_ends, {out.data(), kFloats}, 0.25F, {ends.data(), kEnd, 3 * lights_});
    expect_near(ends, sum);
    kernels_.add_dense(values_.data(), {&block, 1}, {x_.data(), kEnd, 3}, 0.25F,
                       {at_once.data(), kEnd, 3});
    expect_near(std::span(at_once).first(3 * kEnd), std::span(sum).first(3 * kEnd));
  }

 private:
  using Direction = DenseBlock::Direction;

  static constexpr std::uint32_t kFirst = 8, kRow = 48, kColumn = 192, kRowOut = 3;
  static constexpr std::uint32_t kColumnOut = 101, kEnd = 304;
  static constexpr std::size_t kFloats = kEnd * kChannelLanes;

  PlanarVectors<const float> x() const { return {x_.data(), kEnd, 3 * lights_}; }

  static void expect_near(std::span<const float> got, std::span<const float> expected) {
    for (std::size_t k = 0; k < got.size(); ++k) EXPECT_NEAR(got[k], expected[k], kAllowed) << k;
  }

  const CouplingKernels<Value>& kernels_;
  const std::vector<Value>& values_;
  std::span<const float> plain_;
  std::size_t lights_;
  std::vector<float> x_, y_;
};

template <typename Value>
void check_dense(const CouplingKernels<Value>& kernels, const std::vector<Value>& values,
                 const std::vector<float>& plain, std::size_t lights) {
  using Direction = DenseBlock::Direction;
  DenseCheck<Value> dense(kernels, values, plain, lights);
  for (const std::uint32_t rows : {16U, 32U, 80U}) {
    for (const std::uint32_t columns : {16U, 32U, 96U}) {
      for (const Direction direction :
           {Direction::kBoth, Direction::kToRows, Direction::kToColumns}) {
        dense.check(rows, columns, direction);
      }
    }
  }
}

void check_kernels(const BlockKernels& kernels) {
  Random random;
  const std::vector<float> values = random.floats(2 * 96 * 96 + 8 + HierarchicalFormat::kPadding);
  const std::vector<std::uint16_t> half = to_half(values);
  for (const std::size_t lights : {1U, 2U, 3U}) {
    for (const std::size_t rank : {1U, 2U, 3U, 4U, 7U, 17U}) {
      for (const std::size_t size : {16U, 32U, 48U, 96U}) {
        check_bases(kernels.bases_f32, values, {values, rank, size, kAllowed}, lights);
        check_bases(kernels.bases_f16, half, {values, rank, size, kAllowed}, lights);
        check_integer_bases(kernels.bases_q8, rank, size, lights);
        check_integer_bases(kernels.bases_q16, rank, size, lights);
      }
      const auto rows = static_cast<std::uint32_t>(rank);
      for (const std::uint32_t columns : {1U, 4U, 8U, 11U, 16U, 19U, 33U}) {
        check_coupling(kernels.couplings_f32.multiply, values, values, rows, columns, lights);
        check_coupling(kernels.couplings_f16.multiply, half, values, rows, columns, lights);
        check_coupling(kernels.couplings_f32.multiply, values, values, rows, columns, lights, 1);
        check_coupling(kernels.couplings_f16.multiply, half, values, rows, columns, lights, 1);
      }
    }
    check_dense(kernels.couplings_f32, values, values, lights);
    check_dense(kernels.couplings_f16, half, values, lights);
    check_coupling(kernels.couplings_f32.multiply, values, values, 48, 96, lights);
    check_coupling(kernels.couplings_f16.multiply, half, values, 96, 32, lights);
  }
  check_integer_bases(kernels.bases_q16, 134, 304, 1);  // more than a chunk either way
  check_integer_bases(kernels.bases_q8, 134, 304, 1);
}

TEST(BlockKernels, ResidualsBelongToTheFirstCoefficients) {
  constexpr std::uint32_t kRows = 5, kColumns = 7, kRow = 3, kColumn = 20, kEnd = 40;
  constexpr float kScale = HierarchicalFormat::kResidualScale;
  Random random;
  const std::vector<float> values =
      random.floats(kRows * kColumns * 3 + HierarchicalFormat::kPadding);
  const std::vector<float> sent = random.floats(kEnd * kChannelLanes);
  const auto at = [](std::uint32_t k) { return k * kChannelLanes; };
  const CouplingBlock coupling{0, kRows, kColumns, kRow, kColumn, CouplingBlock::Direction::kBoth,
                               2, 3};
  CouplingBlock plain = coupling;
  plain.row_residual_rank = plain.column_residual_rank = 0;
  std::vector<float> whole = sent;  // with what the residuals stand for
  for (std::size_t k = 0; k < 2 * kChannelLanes; ++k)
    whole[at(kRow) + k] += sent[at(kRow + kRows) + k] / kScale;
  for (std::size_t k = 0; k < 3 * kChannelLanes; ++k)
    whole[at(kColumn) + k] += sent[at(kColumn + kColumns) + k] / kScale;
  const ChannelLanes lanes({0, 1, 2}, 3);
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    std::vector<float> expected(kEnd * kChannelLanes, kUntouched), out = expected, both = sent;
    std::vector<float> scratch(scratch_size(kRows, kColumns));
    const auto multiply = [&](const CouplingBlock& block, const std::vector<float>& in,
                              std::vector<float>& to) {
      set->blocks.couplings_f32.multiply(values.data(), {&block, 1}, lanes, 1, {in.data(), 0},
                                         {to.data(), 0}, scratch.data());
    };
    multiply(plain, whole, expected);
    multiply(coupling, sent, out);
    multiply(coupling, both, both);
    for (const std::vector<float>* products : {&out, &both}) {
      for (std::uint32_t k = 0; k < kEnd; ++k) {
        const bool of_row = k >= kRow + kRows && k < kRow + kRows + 2;
        const bool of_column = k >= kColumn + kColumns && k < kColumn + kColumns + 3;
        const bool inside =
            (k >= kRow && k < kRow + kRows + 2) || (k >= kColumn && k < kColumn + kColumns + 3);
        for (std::uint32_t c = 0; c < 3; ++c) {
          const float value = of_row                       ? expected[at(k - kRows) + c] / kScale
                              : of_column                  ? expected[at(k - kColumns) + c] / kScale
                              : inside || products == &out ? expected[at(k) + c]
                                                           : sent[at(k) + c];
          EXPECT_NEAR((*products)[at(k) + c], value, 1e-6F) << k;
        }
      }
    }
  }
}

TEST(BlockKernels, EveryInstructionSetAgrees) {
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    check_kernels(set->blocks);
  }
}

template <typename Value>
const BasisKernels<Value>& integer_kernels(const BlockKernels& set);
template <>
const BasisKernels<std::int16_t>& integer_kernels(const BlockKernels& set) {
  return set.bases_q16;
}
template <>
const BasisKernels<std::int8_t>& integer_kernels(const BlockKernels& set) {
  return set.bases_q8;
}

/// What comes of x by way of coefficients and back: those, and the light.
template <typename Value>
std::vector<float> there_and_back(const BlockKernels& set, const PlainBasis& plain,
                                  const std::vector<float>& x) {
  const BasisKernels<Value>& kernels = integer_kernels<Value>(set);
  const std::vector<Value> basis = in_strips<Value>(plain);
  const BasisPart part = part_of(plain, 0, plain.size);
  std::vector<float> sent(kRankStride * kChannelLanes, 0.0F), y(3 * kStride, 0.0F);
  kernels.project(basis.data(), {&part, 1}, planar(x, 3), side_by_side<float>(sent, 1));
  for (std::size_t k = 3; k < sent.size(); k += kChannelLanes) sent[k] = 0;  // no channel's
  kernels.expand(basis.data(), {&part, 1}, side_by_side<const float>(sent, 1), planar(y, 3));
  sent.insert(sent.end(), y.begin(), y.end());
  return sent;
}

template <typename Value>
class IntegerKernels : public testing::Test {};
using IntegerTypes = testing::Types<std::int16_t, std::int8_t>;
TYPED_TEST_SUITE(IntegerKernels, IntegerTypes);

TYPED_TEST(IntegerKernels, SumsOfIntegersHaveTheSameBitsInEveryInstructionSet) {
  const PlainBasis plain = integer_basis<TypeParam>(134, 304);
  Random random;
  std::vector<float> x = random.floats(3 * kStride);
  for (const float brightest : {x[kFirstPosition + 37], 1e5F}) {  // even light, and uneven
    x[kFirstPosition + 37] = brightest;
    const std::vector<float> expected =
        there_and_back<TypeParam>(kKernelsPortable.blocks, plain, x);
    for (const KernelSet* set : kernel_sets()) {
      EXPECT_EQ(there_and_back<TypeParam>(set->blocks, plain, x), expected) << set->instruction_set;
    }
  }
}

TYPED_TEST(IntegerKernels, BrightPatchesThatDoNotCountLeaveTheOthersTheirLight) {
  constexpr std::size_t kRank = 7, kSize = 304;
  constexpr float kBright = 1e5F;
  PlainBasis plain = integer_basis<TypeParam>(kRank, kSize);
  Random random;
  std::vector<float> x = random.floats(3 * kStride);
  for (const std::size_t bright : {37U, 38U, 140U}) {
    for (std::size_t r = 0; r < kRank; ++r) plain.value[r * kSize + bright] = 0;
    for (std::size_t c = 0; c < 3; ++c) x[c * kStride + kFirstPosition + bright] = 0;
  }
  std::vector<float> uneven = x;
  for (const std::size_t bright : {37U, 38U, 140U}) {
    for (std::size_t c = 0; c < 3; ++c) uneven[c * kStride + kFirstPosition + bright] = kBright;
  }
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    const std::vector<float> expected = there_and_back<TypeParam>(set->blocks, plain, x);
    const std::vector<float> result = there_and_back<TypeParam>(set->blocks, plain, uneven);
    float largest = 0;
    for (std::size_t r = 0; r < kRank * kChannelLanes; ++r) {
      largest = std::max(largest, std::abs(expected[coefficient_at(0, 0) + r]));
    }
    for (std::size_t r = 0; r < kRank; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = coefficient_at(0, 0) + r * kChannelLanes + c;
        EXPECT_NEAR(result[at], expected[at], 2e-3F * largest);
      }
    }
  }
}

TYPED_TEST(IntegerKernels, SumsOfIntegersHaveRoomForTheLargest) {
  constexpr std::size_t kRank = 128, kSize = 128;
  constexpr float kLargest = kLargestInteger<TypeParam>;
  const PlainBasis plain{std::vector<float>(kRank * kSize, kLargest), kRank, kSize, 0};
  // Just below a power of two: it becomes the largest integer that there is.
  const float light = std::nextafter(1.0F, 0.0F);
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    const std::vector<float> result =
        there_and_back<TypeParam>(set->blocks, plain, std::vector<float>(3 * kStride, light));
    const double sent = kSize * kLargest * light, y = kRank * kLargest * sent;
    EXPECT_NEAR(result[coefficient_at(0, 0)] / sent, 1, 3e-4);
    EXPECT_NEAR(result[kRankStride * kChannelLanes + kFirstPosition] / y, 1, 6e-4);
  }
}

TYPED_TEST(IntegerKernels, NoLightStaysNone) {
  const PlainBasis plain = integer_basis<TypeParam>(7, 48);
  for (const float light : {0.0F, 1e-42F}) {
    for (const KernelSet* set : kernel_sets()) {
      const std::vector<float> result =
          there_and_back<TypeParam>(set->blocks, plain, std::vector<float>(3 * kStride, light));
      for (const float value : result) EXPECT_LE(std::abs(value), 1e-20F);
    }
  }
}

}  // namespace
}  // namespace rebounce
