// The kernels of hierarchical operators in every instruction set, against plain sums.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "transfer/base/half_float.h"
#include "transfer/format/operator_format.h"
#include "transfer/kernels/kernels.h"

namespace rebounce::test_block_kernels {
namespace {

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
std::vector<std::int8_t> in_strips(const PlainBasis& plain) {
  std::vector<std::int8_t> values;
  for (std::size_t strip = 0; strip < plain.size; strip += 64) {
    for (std::size_t group = 0; group < plain.rank; group += 4) {
      for (std::size_t k = strip; k < std::min(strip + 64, plain.size); k += 2) {
        for (std::size_t r = group; r < group + 4; ++r) {
          for (std::size_t i = k; i < k + 2; ++i) {
            const float value = r < plain.rank ? plain.value[r * plain.size + i] : 0;
            values.push_back(static_cast<std::int8_t>(value));
          }
        }
      }
    }
  }
  return values;
}

constexpr float kLargestInteger = 127;

/// Integers up to the largest.
PlainBasis integer_basis(std::size_t rank, std::size_t size) {
  // Light up to 1 is a multiple of this at most.
  constexpr double kLightStep = 0x1p-14;
  Random random;
  PlainBasis plain{random.floats(rank * size), rank, size, 0};
  for (float& value : plain.value) value = std::round(kLargestInteger * value);
  plain.value.front() = -kLargestInteger;
  plain.allowed = kLightStep / 2 * kLargestInteger * static_cast<double>(std::max(rank, size));
  return plain;
}

void check_integer_bases(const BasisKernels<std::int8_t>& kernels, std::size_t rank,
                         std::size_t size, std::size_t lights) {
  const PlainBasis plain = integer_basis(rank, size);
  const std::vector<std::int8_t> basis = in_strips(plain);
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
  check_integer_bases(kernels.bases_q8, 134, 304, 1);  // more than a chunk either way
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

/// What comes of x by way of coefficients and back: those, and the light.
std::vector<float> there_and_back(const BlockKernels& set, const PlainBasis& plain,
                                  const std::vector<float>& x) {
  const BasisKernels<std::int8_t>& kernels = set.bases_q8;
  const std::vector<std::int8_t> basis = in_strips(plain);
  const BasisPart part = part_of(plain, 0, plain.size);
  std::vector<float> sent(kRankStride * kChannelLanes, 0.0F), y(3 * kStride, 0.0F);
  kernels.project(basis.data(), {&part, 1}, planar(x, 3), side_by_side<float>(sent, 1));
  for (std::size_t k = 3; k < sent.size(); k += kChannelLanes) sent[k] = 0;  // no channel's
  kernels.expand(basis.data(), {&part, 1}, side_by_side<const float>(sent, 1), planar(y, 3));
  sent.insert(sent.end(), y.begin(), y.end());
  return sent;
}

TEST(IntegerKernels, SumsOfIntegersHaveTheSameBitsInEveryInstructionSet) {
  const PlainBasis plain = integer_basis(134, 304);
  Random random;
  std::vector<float> x = random.floats(3 * kStride);
  for (const float brightest : {x[kFirstPosition + 37], 1e5F}) {  // even light, and uneven
    x[kFirstPosition + 37] = brightest;
    const std::vector<float> expected = there_and_back(kKernelsPortable.blocks, plain, x);
    for (const KernelSet* set : kernel_sets()) {
      EXPECT_EQ(there_and_back(set->blocks, plain, x), expected) << set->instruction_set;
    }
  }
}

TEST(IntegerKernels, BrightPatchesThatDoNotCountLeaveTheOthersTheirLight) {
  constexpr std::size_t kRank = 7, kSize = 304;
  constexpr float kBright = 1e5F;
  PlainBasis plain = integer_basis(kRank, kSize);
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
    const std::vector<float> expected = there_and_back(set->blocks, plain, x);
    const std::vector<float> result = there_and_back(set->blocks, plain, uneven);
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

TEST(IntegerKernels, SumsOfIntegersHaveRoomForTheLargest) {
  constexpr std::size_t kRank = 128, kSize = 128;
  const PlainBasis plain{std::vector<float>(kRank * kSize, kLargestInteger), kRank, kSize, 0};
  // Just below a power of two: it becomes the largest integer that there is.
  const float light = std::nextafter(1.0F, 0.0F);
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    const std::vector<float> result =
        there_and_back(set->blocks, plain, std::vector<float>(3 * kStride, light));
    const double sent = kSize * kLargestInteger * light, y = kRank * kLargestInteger * sent;
    EXPECT_NEAR(result[coefficient_at(0, 0)] / sent, 1, 3e-4);
    EXPECT_NEAR(result[kRankStride * kChannelLanes + kFirstPosition] / y, 1, 6e-4);
  }
}

TEST(IntegerKernels, NoLightStaysNone) {
  const PlainBasis plain = integer_basis(7, 48);
  for (const float light : {0.0F, 1e-42F}) {
    for (const KernelSet* set : kernel_sets()) {
      const std::vector<float> result =
          there_and_back(set->blocks, plain, std::vector<float>(3 * kStride, light));
      for (const float value : result) EXPECT_LE(std::abs(value), 1e-20F);
    }
  }
}

}  // namespace
}  // namespace rebounce::test_block_kernels
