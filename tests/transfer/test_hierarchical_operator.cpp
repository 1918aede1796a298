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

TEST(HierarchicalOperator, AllocatesNothing) {
  const HierarchicalOperator op(random_hierarchical_storage(500, 3, 8));
  const std::vector<Float3> m0 = random_light(500, 3);
  std::vector<Float3> h(m0.size());
  std::vector<float> workspace(op.workspace_size());
  op.apply(m0, h, workspace);
  EXPECT_EQ(test::count_allocations([&] { op.apply(m0, h, workspace); }), 0);
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

/// Vectors and matrices with random entries, as floats and as halves.
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

// Sums of up to 96 products of numbers below 1.
constexpr double kAllowed = 1e-5;

template <typename Value>
void check_bases(const BlockKernels<Value>& kernels, const Value* basis,
                 const std::vector<float>& plain, std::size_t rank, std::size_t size) {
  constexpr std::size_t kStride = 100, kRankStride = 20;
  Random random;
  const std::vector<float> x = random.floats(3 * kStride), y = random.floats(3 * kStride);
  std::vector<float> coefficient(3 * kRankStride), sum = y;
  kernels.project(basis, rank, size, x.data(), kStride, coefficient.data(), kRankStride);
  kernels.expand(basis, rank, size, coefficient.data(), kRankStride, sum.data(), kStride);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t r = 0; r < rank; ++r) {
      double expected = 0;
      for (std::size_t k = 0; k < size; ++k) expected += plain[r * size + k] * x[c * kStride + k];
      EXPECT_NEAR(coefficient[c * kRankStride + r], expected, kAllowed);
    }
    for (std::size_t k = 0; k < size; ++k) {
      double expected = y[c * kStride + k];
      for (std::size_t r = 0; r < rank; ++r) {
        expected += plain[r * size + k] * coefficient[c * kRankStride + r];
      }
      EXPECT_NEAR(sum[c * kStride + k], expected, kAllowed);
    }
  }
}

template <typename Value>
void check_core(const BlockKernels<Value>& kernels, const Value* core,
                const std::vector<float>& plain, std::size_t rows, std::size_t columns) {
  Random random;
  std::vector<float> column_in = random.floats(32), row_in = random.floats(32);
  std::fill(column_in.begin() + static_cast<std::ptrdiff_t>(columns), column_in.end(), 0.0F);
  std::vector<float> row_out(32), column_out(32);
  kernels.core(core, rows, columns, column_in.data(), row_in.data(), row_out.data(),
               column_out.data());
  for (std::size_t i = 0; i < rows; ++i) {
    double expected = 0;
    for (std::size_t j = 0; j < columns; ++j) expected += plain[i * columns + j] * column_in[j];
    EXPECT_NEAR(row_out[i], expected, kAllowed);
  }
  for (std::size_t j = 0; j < columns; ++j) {
    double expected = 0;
    for (std::size_t i = 0; i < rows; ++i) expected += plain[i * columns + j] * row_in[i];
    EXPECT_NEAR(column_out[j], expected, kAllowed);
  }
}

template <typename Value>
void check_dense(const BlockKernels<Value>& kernels, const Value* block,
                 const std::vector<float>& plain, std::size_t rows, std::size_t columns) {
  Random random;
  const std::vector<float> x_row = random.floats(rows), x_column = random.floats(columns);
  std::vector<float> y_row(rows, 1), y_column(columns, 2), diagonal(rows, 3);
  kernels.dense(block, rows, columns, x_column.data(), x_row.data(), y_row.data(), y_column.data());
  if (rows == columns) kernels.dense_diagonal(block, rows, x_column.data(), diagonal.data());
  for (std::size_t i = 0; i < rows; ++i) {
    double expected = 0;
    for (std::size_t j = 0; j < columns; ++j) expected += plain[i * columns + j] * x_column[j];
    EXPECT_NEAR(y_row[i], 1 + expected, kAllowed);
    if (rows == columns) {
      EXPECT_NEAR(diagonal[i], 3 + expected, kAllowed);
    }
  }
  for (std::size_t j = 0; j < columns; ++j) {
    double expected = 2;
    for (std::size_t i = 0; i < rows; ++i) expected += plain[i * columns + j] * x_row[i];
    EXPECT_NEAR(y_column[j], expected, kAllowed);
  }
}

void check_kernels(const BlockKernelSet& kernels) {
  SCOPED_TRACE(kernels.instruction_set);
  Random random;
  const std::vector<float> values = random.floats(96 * 96 + HierarchicalOperator::kPadding);
  const std::vector<std::uint16_t> half = to_half(values);
  for (const std::size_t rank : {1U, 3U, 4U, 7U, 17U}) {
    for (const std::size_t size : {16U, 48U, 96U}) {
      check_bases(kernels.f32, values.data(), values, rank, size);
      check_bases(kernels.f16, half.data(), values, rank, size);
    }
    for (const std::size_t columns : {1U, 8U, 11U, 16U, 19U}) {
      check_core(kernels.f32, values.data(), values, rank, columns);
      check_core(kernels.f16, half.data(), values, rank, columns);
    }
  }
  for (const std::size_t rows : {16U, 32U, 48U}) {
    for (const std::size_t columns : {16U, 32U, 48U, 96U}) {
      check_dense(kernels.f32, values.data(), values, rows, columns);
      check_dense(kernels.f16, half.data(), values, rows, columns);
    }
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
