#include "rebounce/transfer/hierarchical_operator.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "../../transfer/block_kernels.h"
#include "../../transfer/half_float.h"
#include "../../transfer/instruction_set.h"
#include "allocation_counter.h"
#include "expect_error.h"
#include "hierarchical_samples.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using test::expect_error;
using test::random_hierarchical_storage;

std::vector<Float3> random_light(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<float> uniform(0, 100);
  std::vector<Float3> light(n);
  for (Float3& v : light) v = {uniform(engine), uniform(engine), uniform(engine)};
  return light;
}

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
      const std::vector<Float3> m0 = random_light(n, n);
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
  const HierarchicalOperator::Storage storage = random_hierarchical_storage(500, 3, 5);
  const HierarchicalOperator exact(storage);
  const HierarchicalOperator half(HierarchicalOperator::encode_half(storage));
  EXPECT_EQ(2 * half.storage().values_f16.size_bytes(), exact.storage().values_f32.size_bytes());
  const std::vector<Float3> m0 = random_light(500, 1);
  const std::vector<float>& area = storage.area;
  EXPECT_LT(relative_difference(product(half, m0), multiply_expansion(half, m0), area), 2e-6);
  const double error = relative_difference(product(half, m0), product(exact, m0), area);
  EXPECT_LT(error, 1e-3);  // 11 bits per value, three factors to an entry
  EXPECT_GT(error, 0);
}

TEST(HierarchicalOperator, BytesAreAsGoodAsTheirBits) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const HierarchicalOperator::Storage storage = random_hierarchical_storage(500, matrices, 5);
    const HierarchicalOperator exact(storage);
    const HierarchicalOperator bytes(HierarchicalOperator::encode_bytes(storage));
    EXPECT_LT(bytes.bytes(), exact.bytes() / 2);
    const std::vector<Float3> m0 = random_light(500, 1);
    const std::vector<float>& area = storage.area;
    EXPECT_LT(relative_difference(product(bytes, m0), multiply_expansion(bytes, m0), area), 2e-6);
    const double error = relative_difference(product(bytes, m0), product(exact, m0), area);
    EXPECT_LT(error, 5e-3);  // 7 bits per value of a basis, two of them to an entry
    EXPECT_GT(error, 1e-5);
  }
}

TEST(HierarchicalOperator, SameBitsForAnyNumberOfThreads) {
  const HierarchicalOperator op(random_hierarchical_storage(777, 3, 6));
  const std::vector<Float3> m0 = random_light(777, 2);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const std::vector<Float3> one = product(op, m0);
  omp_set_num_threads(5);
  const std::vector<Float3> five = product(op, m0);
  omp_set_num_threads(before);
  EXPECT_EQ(one, five);
}

std::vector<Float3> batch_product(const TransferOperator& op, std::size_t lights,
                                  const std::vector<Float3>& m0) {
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.batch_workspace_size(lights), std::nanf(""));
  op.apply_batch(lights, m0, h, workspace);
  return h;
}

TEST(HierarchicalOperator, ABatchIsAsManyApplies) {
  for (const std::uint32_t matrices : {1U, 2U, 3U}) {
    const std::size_t n = 333;
    const HierarchicalOperator::Storage storage =
        random_hierarchical_storage(n, matrices, 40 + matrices);
    for (const HierarchicalOperator& op :
         {HierarchicalOperator(storage),
          HierarchicalOperator(HierarchicalOperator::encode_half(storage))}) {
      for (const std::size_t lights : {1U, 2U, 3U, 5U}) {
        const std::vector<Float3> m0 = random_light(lights * n, lights);
        const std::vector<Float3> batch = batch_product(op, lights, m0);
        for (std::size_t light = 0; light < lights; ++light) {
          const auto at = static_cast<std::ptrdiff_t>(light * n);
          const auto end = at + static_cast<std::ptrdiff_t>(n);
          const std::vector<Float3> one(m0.begin() + at, m0.begin() + end);
          const std::vector<Float3> part(batch.begin() + at, batch.begin() + end);
          EXPECT_LT(relative_difference(part, product(op, one), storage.area), 1e-6);
        }
      }
    }
  }
}

TEST(HierarchicalOperator, ReceiversGetWhatAnApplyGivesThemAndNothingElseIsTouched) {
  const std::size_t n = 777;
  const HierarchicalOperator op(random_hierarchical_storage(n, 3, 12));
  const std::vector<Float3> m0 = random_light(n, 4), whole = product(op, m0);
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
    std::vector<Float3> expected(n, kUnset);
    for (const std::uint32_t p : patches) expected[p] = whole[p];
    for (std::size_t i = 0; i < n; ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        EXPECT_NEAR(h[i][c], expected[i][c], 2e-6F * std::abs(expected[i][c]));
      }
    }
    EXPECT_TRUE(receivers.value_count() > previous || count == 0);
    previous = receivers.value_count();
  }
  EXPECT_EQ(op.receivers(std::vector<std::uint32_t>{}).value_count(), 0U);
  expect_error([&] { (void)op.receivers(std::vector<std::uint32_t>{777}); }, "does not exist");
}

TEST(HierarchicalOperator, TheOrderOfTheValuesMakesNoDifference) {
  const HierarchicalOperator::Storage by_block = random_hierarchical_storage(500, 2, 9);
  const HierarchicalOperator::Storage streamed = HierarchicalOperator::stream(by_block);
  const std::vector<Float3> m0 = random_light(500, 5);
  EXPECT_EQ(streamed.order, HierarchicalOperator::Order::kStreamed);
  EXPECT_EQ(streamed.values_f32.size() % 64, 0U);
  EXPECT_EQ(product(HierarchicalOperator(by_block), m0),
            product(HierarchicalOperator(streamed), m0));
}

TEST(HierarchicalOperator, AllocatesNothing) {
  const HierarchicalOperator op(random_hierarchical_storage(500, 3, 8));
  const std::vector<Float3> m0 = random_light(500, 3);
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
  using Storage = HierarchicalOperator::Storage;
  using Kind = TransferBlock::Kind;
  struct Fault {
    const char* message;
    std::function<void(Storage&)> make;
  };
  const std::vector<Fault> faults = {
      {"no patches", [](Storage& s) { s.area.clear(), s.patch.clear(), s.blocks.clear(); }},
      {"1, 2 or 3 matrices", [](Storage& s) { s.matrix_count = 0; }},
      {"1, 2 or 3 matrices", [](Storage& s) { s.matrix_count = 4; }},
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
      {"unknown kind", [](Storage& s) { s.blocks[0].kind = static_cast<Kind>(2); }},
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
      {"number of values", [](Storage& s) { s.blocks.pop_back(); }},
      {"number of values", [](Storage& s) { s.order = HierarchicalOperator::Order::kStreamed; }},
      {"number of values", [](Storage& s) { s.precision = Precision::kF16; }},
  };
  for (std::size_t k = 0; k < faults.size(); ++k) {
    SCOPED_TRACE("fault " + std::to_string(k) + ": " + faults[k].message);
    Storage storage = random_hierarchical_storage(100, 3, 1);
    ASSERT_TRUE(storage.blocks[0].on_diagonal());
    faults[k].make(storage);
    expect_error([&] { HierarchicalOperator{storage}; }, faults[k].message);
  }
}

TEST(HierarchicalOperator, RefusesHalfPrecisionBeyondItsRange) {
  HierarchicalOperator::Storage storage = random_hierarchical_storage(100, 1, 1);
  storage.values_f32 =
      SharedArray(std::vector<float>(storage.values_f32.size(), 100.0F));  // x 1024 is too much
  expect_error([&] { HierarchicalOperator::encode_half(storage); }, "too large for f16");
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

// Relative to sums of up to 96 products of numbers below 1, or below 128 for bytes.
constexpr double kAllowed = 1e-5;

// What a kernel must not touch keeps this value.
constexpr float kUntouched = -1234;

PlanarVectors<const float> planar(const std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}
PlanarVectors<float> planar(std::vector<float>& data, std::size_t count) {
  return {data.data(), data.size() / count, count};
}

template <typename Value>
void check_bases(const BasisKernels<Value>& kernels, const std::vector<Value>& basis,
                 const std::vector<float>& plain, std::size_t rank, std::size_t size,
                 std::size_t count) {
  constexpr std::size_t kStride = 100, kRankStride = 20;
  const double allowed = kAllowed * (sizeof(Value) == 1 ? 128 : 1);
  Random random;
  const std::vector<float> x = random.floats(count * kStride), y = random.floats(count * kStride);
  const std::vector<float> scale = random.floats(count * kRankStride);
  std::vector<float> coefficient(count * kRankStride, kUntouched), sum = y;
  kernels.project(basis.data(), rank, size, planar(x, count), planar(coefficient, count));
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t r = 0; r < kRankStride; ++r) {
      double expected = r < rank ? 0 : kUntouched;
      for (std::size_t k = 0; k < size && r < rank; ++k) {
        expected += plain[r * size + k] * x[v * kStride + k];
      }
      EXPECT_NEAR(coefficient[v * kRankStride + r], expected, allowed);
    }
  }
  for (std::size_t part = 16; part <= size; part += 16) {
    sum = y;
    kernels.expand(basis.data() + size - part, rank, size, part, planar(scale, count),
                   planar(sum, count));
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t k = 0; k < kStride; ++k) {
        double expected = y[v * kStride + k];
        for (std::size_t r = 0; r < rank && k < part; ++r) {
          expected += plain[r * size + size - part + k] * scale[v * kRankStride + r];
        }
        EXPECT_NEAR(sum[v * kStride + k], expected, allowed);
      }
    }
  }
}

template <typename Value>
void check_core(const CoreKernels<Value>& kernels, const std::vector<Value>& values,
                const std::vector<float>& plain, std::size_t rows, std::size_t columns,
                std::size_t lights) {
  constexpr std::size_t kStride = 110;
  const std::size_t count = 3 * lights;
  const CoreMatrices<Value> matrices{values.data(), rows, columns, {1, 0, 1}};
  Random random;
  const std::vector<float> row_in = random.floats(count * kStride);
  const std::vector<float> column_in = random.floats(count * kStride);
  for (const bool to_rows : {true, false}) {
    for (const bool to_columns : {true, false}) {
      if (!to_rows && !to_columns) continue;
      std::vector<float> row_out(count * kStride, kUntouched), column_out = row_out;
      const auto product = !to_columns ? kernels.to_rows
                           : !to_rows  ? kernels.to_columns
                                       : kernels.both;
      product(matrices, {planar(row_in, count), planar(column_in, count), planar(row_out, count),
                         planar(column_out, count)});
      for (std::size_t v = 0; v < count; ++v) {
        const float* s = plain.data() + matrices.channel_matrix[v % 3] * rows * columns;
        for (std::size_t i = 0; i < kStride; ++i) {
          double expected = to_rows && i < rows ? 0 : kUntouched;
          for (std::size_t j = 0; j < columns && to_rows && i < rows; ++j) {
            expected += s[i * columns + j] * column_in[v * kStride + j];
          }
          EXPECT_NEAR(row_out[v * kStride + i], expected, kAllowed);
        }
        for (std::size_t j = 0; j < kStride; ++j) {
          double expected = to_columns && j < columns ? 0 : kUntouched;
          for (std::size_t i = 0; i < rows && to_columns && j < columns; ++i) {
            expected += s[i * columns + j] * row_in[v * kStride + i];
          }
          EXPECT_NEAR(column_out[v * kStride + j], expected, kAllowed);
        }
      }
    }
  }
}

void check_kernels(const BlockKernelSet& kernels) {
  SCOPED_TRACE(kernels.instruction_set);
  Random random;
  const std::vector<float> values = random.floats(2 * 96 * 96 + HierarchicalOperator::kPadding);
  const std::vector<std::uint16_t> half = to_half(values);
  std::vector<std::int8_t> bytes(values.size());
  std::ranges::transform(values, bytes.begin(),
                         [](float v) { return static_cast<std::int8_t>(127 * v); });
  const std::vector<float> plain_bytes(bytes.begin(), bytes.end());
  for (const std::size_t lights : {1U, 2U, 3U}) {
    for (const std::size_t rank : {1U, 2U, 3U, 4U, 7U, 17U}) {
      for (const std::size_t size : {16U, 32U, 48U, 96U}) {
        check_bases(kernels.bases_f32, values, values, rank, size, 3 * lights);
        check_bases(kernels.bases_f16, half, values, rank, size, 3 * lights);
        check_bases(kernels.bases_q8, bytes, plain_bytes, rank, size, 3 * lights);
      }
      for (const std::size_t columns : {1U, 4U, 8U, 11U, 16U, 19U, 33U}) {
        check_core(kernels.cores_f32, values, values, rank, columns, lights);
        check_core(kernels.cores_f16, half, values, rank, columns, lights);
      }
    }
    check_core(kernels.cores_f32, values, values, 48, 96, lights);
    check_core(kernels.cores_f16, half, values, 96, 32, lights);
  }
}

TEST(BlockKernels, EveryInstructionSetAgrees) {
  check_kernels(kBlockKernelsPortable);
#if defined(__x86_64__)
  const InstructionSet widest = widest_instruction_set();
  if (widest >= InstructionSet::kAvx2) check_kernels(kBlockKernelsAvx2);
  if (widest >= InstructionSet::kAvx512) check_kernels(kBlockKernelsAvx512);
#endif
}

}  // namespace
}  // namespace rebounce
