// The kernels of coupling matrices and dense blocks in every instruction set, against plain sums.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "tests/transfer/kernels/kernel_samples.h"
#include "transfer/format/operator_format.h"
#include "transfer/format/row_format.h"
#include "transfer/format/row_packing.h"
#include "transfer/kernels/kernels.h"

namespace rebounce::test_block_kernels {
namespace {

using test::kAllowed;
using test::kUntouched;
using test::Random;
using test::to_half;

std::vector<float> scratch_of(const CouplingBlock& coupling) {
  return std::vector<float>(scratch_size(coupling.rows, coupling.columns), std::nanf(""));
}

/// Products that are written over what they are of are the same.
template <typename Value>
void check_in_place(CouplingKernel<Value> multiply_couplings, const CouplingValues<Value>& values,
                    const CouplingBlock& coupling, const ChannelLanes& lanes, std::size_t lights,
                    const std::vector<float>& in, const std::vector<float>& out) {
  std::vector<float> both = in, scratch = scratch_of(coupling);
  const std::size_t stride = in.size() / lights;
  multiply_couplings(values, {&coupling, 1}, lanes, lights, {both.data(), stride},
                     {both.data(), stride}, scratch.data());
  for (std::size_t k = 0; k < both.size(); ++k) {
    EXPECT_EQ(both[k], out[k] == kUntouched ? in[k] : out[k]) << k;
  }
}

/// Checks products with the matrix whose entries are `plain`, [rows][columns][matrices].
/// `first_row`: of a packed matrix, which begins with the first byte; others begin with value 8.
template <typename Value>
void check_coupling(CouplingKernel<Value> multiply_couplings, const CouplingValues<Value>& values,
                    std::span<const float> plain, std::uint32_t rows, std::uint32_t columns,
                    std::size_t lights, std::uint32_t matrices = 2,
                    std::uint32_t first_row = kNotPacked) {
  using Direction = CouplingBlock::Direction;
  constexpr std::uint32_t kRow = 3, kColumn = 99, kEnd = 200;
  const std::uint32_t last = matrices - 1;
  const std::array<std::uint32_t, 3> matrix{last, 0, last};
  Random random;
  std::vector<float> in = random.floats(lights * kEnd * kChannelLanes);
  const ChannelLanes lanes(matrix, matrices);
  for (const Direction direction : {Direction::kBoth, Direction::kToRows, Direction::kToColumns}) {
    const CouplingBlock coupling{.values = first_row == kNotPacked ? 8U : 0U,
                                 .rows = rows,
                                 .columns = columns,
                                 .row = kRow,
                                 .column = kColumn,
                                 .direction = direction,
                                 .first_row = first_row};
    std::vector<float> out(lights * kEnd * kChannelLanes, kUntouched);
    std::vector<float> scratch = scratch_of(coupling);
    multiply_couplings(values, {&coupling, 1}, lanes, lights, {in.data(), kEnd * kChannelLanes},
                       {out.data(), kEnd * kChannelLanes}, scratch.data());
    check_in_place(multiply_couplings, values, coupling, lanes, lights, in, out);
    for (std::size_t v = 0; v < 3 * lights; ++v) {
      const auto at = [v](std::size_t k) { return (v / 3 * kEnd + k) * kChannelLanes + v % 3; };
      const auto entry = [&](std::size_t i, std::size_t j) {
        return plain[(i * columns + j) * matrices + matrix[v % 3]];
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
  const auto from_eighth = std::span(values).subspan(8);
  for (const std::size_t lights : {1U, 2U, 3U}) {
    for (const std::uint32_t rows : {1U, 2U, 3U, 4U, 7U, 17U}) {
      for (const std::uint32_t columns : {1U, 4U, 8U, 11U, 16U, 19U, 33U}) {
        check_coupling(kernels.couplings_f32.multiply, {values.data()}, from_eighth, rows, columns,
                       lights);
        check_coupling(kernels.couplings_f16.multiply, {half.data()}, from_eighth, rows, columns,
                       lights);
        check_coupling(kernels.couplings_f32.multiply, {values.data()}, from_eighth, rows, columns,
                       lights, 1);
        check_coupling(kernels.couplings_f16.multiply, {half.data()}, from_eighth, rows, columns,
                       lights, 1);
      }
    }
    check_dense(kernels.couplings_f32, values, values, lights);
    check_dense(kernels.couplings_f16, half, values, lights);
    check_coupling(kernels.couplings_f32.multiply, {values.data()}, from_eighth, 48, 96, lights);
    check_coupling(kernels.couplings_f16.multiply, {half.data()}, from_eighth, 96, 32, lights);
  }
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
      set->blocks.couplings_f32.multiply({values.data()}, {&block, 1}, lanes, 1, {in.data(), 0},
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

TEST(BlockKernels, CouplingMatricesWithoutLightAtAnEndGiveNone) {
  constexpr std::uint32_t kRows = 7, kColumns = 18, kRow = 2, kColumn = 40, kEnd = 70;
  Random random;
  const std::vector<float> values = random.floats(kRows * kColumns + HierarchicalFormat::kPadding);
  const ChannelLanes lanes({0, 0, 0}, 1);
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    for (const bool row_lit : {false, true}) {
      for (const bool column_lit : {false, true}) {
        std::vector<float> in = random.floats(kEnd * kChannelLanes);
        const auto darken = [&](std::size_t first, std::size_t count) {
          for (std::size_t k = first; k < first + count; ++k) {
            for (std::size_t c = 0; c < 3; ++c) in[k * kChannelLanes + c] = 0;
          }
        };
        if (!row_lit) darken(kRow, kRows + 2);
        if (!column_lit) darken(kColumn, kColumns + 3);
        const CouplingBlock coupling{.values = 0,
                                     .rows = kRows,
                                     .columns = kColumns,
                                     .row = kRow,
                                     .column = kColumn,
                                     .direction = CouplingBlock::Direction::kBoth,
                                     .row_residual_rank = 2,
                                     .column_residual_rank = 3};
        std::vector<float> scratch = scratch_of(coupling), out = in;
        set->blocks.couplings_f32.multiply({values.data()}, {&coupling, 1}, lanes, 1,
                                           {out.data(), 0}, {out.data(), 0}, scratch.data());
        for (std::size_t k = kColumn; k < kColumn + kColumns + 3; ++k) {
          EXPECT_EQ(out[k * kChannelLanes] != 0, row_lit) << k;
        }
        for (std::size_t k = kRow; k < kRow + kRows + 2; ++k) {
          EXPECT_EQ(out[k * kChannelLanes] != 0, column_lit) << k;
        }
      }
    }
  }
}

/// A packed coupling matrix with rows of all formats.
struct PackedMatrix {
  std::vector<std::uint8_t> bytes, formats;
  std::vector<float> plain;  ///< [rows][row_size]

  PackedMatrix(std::size_t rows, std::size_t row_size) {
    RowPacking packing;
    Random random;
    for (std::size_t r = 0; r < rows; ++r) {
      std::vector<float> row = random.floats(row_size);
      row.front() = 1;
      // Largest integers of 5, 96, 1,536 and 24,576.
      const double step = std::ldexp(1.0, -2 - 4 * static_cast<int>(r % 4)) * 0.75;
      packing.append(row, step);
      const RowFormat format{packing.formats().back()};
      EXPECT_EQ(format.bits(), 4 + 4 * (r % 4));
      for (const float entry : row) {
        plain.push_back(std::round(entry / format.step()) * format.step());
      }
    }
    formats = packing.formats();
    bytes = packing.release_bytes();
  }
};

TEST(BlockKernels, MultiplyPackedCouplingMatrices) {
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    for (const std::uint32_t matrices : {1U, 2U, 3U}) {
      // The last one is unpacked in several parts.
      for (const std::uint32_t rows : {1U, 4U, 7U, 17U, 95U}) {
        for (const std::uint32_t columns : {1U, 4U, 5U, 16U, 33U, 90U}) {
          const PackedMatrix matrix(rows, std::size_t{columns} * matrices);
          const CouplingValues<std::uint16_t> values{nullptr, matrix.bytes.data(),
                                                     matrix.formats.data()};
          check_coupling(set->blocks.couplings_f16.multiply, values, matrix.plain, rows, columns, 2,
                         matrices, 0);
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

}  // namespace
}  // namespace rebounce::test_block_kernels
