// The kernels of bases in every instruction set, against plain sums.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/transfer/kernels/kernel_samples.h"
#include "transfer/format/operator_format.h"
#include "transfer/kernels/kernels.h"

namespace rebounce::test_basis_kernels {
namespace {

using test::kAllowed;
using test::kUntouched;
using test::planar;
using test::Random;
using test::side_by_side;
using test::to_half;

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
  kernels.project(basis.data(), {&part, 1}, planar(x, 3 * lights), nullptr,
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

/// A basis in the order of the file: strips of 64 positions, groups of four ranks, groups of four
/// positions.
std::vector<std::int8_t> in_strips(const PlainBasis& plain) {
  std::vector<std::int8_t> values;
  for (std::size_t strip = 0; strip < plain.size; strip += 64) {
    for (std::size_t group = 0; group < plain.rank; group += 4) {
      for (std::size_t k = strip; k < std::min(strip + 64, plain.size); k += 4) {
        for (std::size_t r = group; r < group + 4; ++r) {
          for (std::size_t i = k; i < k + 4; ++i) {
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

void check_all_bases(const BlockKernels& kernels) {
  Random random;
  const std::vector<float> values = random.floats(96 * 96);
  const std::vector<std::uint16_t> half = to_half(values);
  for (const std::size_t lights : {1U, 2U, 3U}) {
    for (const std::size_t rank : {1U, 2U, 3U, 4U, 7U, 17U}) {
      for (const std::size_t size : {16U, 32U, 48U, 96U}) {
        check_bases(kernels.bases_f32, values, {values, rank, size, kAllowed}, lights);
        check_bases(kernels.bases_f16, half, {values, rank, size, kAllowed}, lights);
        check_integer_bases(kernels.bases_q8, rank, size, lights);
      }
    }
  }
  check_integer_bases(kernels.bases_q8, 134, 304, 1);  // more than a chunk either way
}

TEST(BasisKernels, EveryInstructionSetAgrees) {
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    check_all_bases(set->blocks);
  }
}

/// What comes of x by way of coefficients and back: those, and the light.
std::vector<float> there_and_back(const BlockKernels& set, const PlainBasis& plain,
                                  const std::vector<float>& x) {
  const BasisKernels<std::int8_t>& kernels = set.bases_q8;
  const std::vector<std::int8_t> basis = in_strips(plain);
  const BasisPart part = part_of(plain, 0, plain.size);
  std::vector<float> sent(kRankStride * kChannelLanes, 0.0F), y(3 * kStride, 0.0F);
  kernels.project(basis.data(), {&part, 1}, planar(x, 3), nullptr, side_by_side<float>(sent, 1));
  for (std::size_t k = 3; k < sent.size(); k += kChannelLanes) sent[k] = 0;  // no channel's
  kernels.expand(basis.data(), {&part, 1}, side_by_side<const float>(sent, 1), planar(y, 3));
  sent.insert(sent.end(), y.begin(), y.end());
  return sent;
}

/// Light between `least` and 1 at every position.
std::vector<float> light_from(float least) {
  Random random;
  std::vector<float> x = random.floats(3 * kStride);
  for (float& value : x) value = least + (value + 1) / 2 * (1 - least);
  return x;
}

/// Makes some positions of a cluster dark, in all channels.
void darken(std::vector<float>& x, std::size_t begin, std::size_t end) {
  for (std::size_t c = 0; c < 3; ++c) {
    const auto at = x.begin() + static_cast<std::ptrdiff_t>(c * kStride + kFirstPosition);
    std::fill(at + static_cast<std::ptrdiff_t>(begin), at + static_cast<std::ptrdiff_t>(end), 0.0F);
  }
}

TEST(IntegerKernels, SumsOfIntegersHaveTheSameBitsInEveryInstructionSet) {
  const PlainBasis plain = integer_basis(134, 304);
  for (const float least : {-1.0F, 0.25F}) {
    // Even light, and uneven.
    for (const float brightest : {1.0F, 1e2F, 1e4F, 1e7F}) {
      for (const std::size_t dark : {0U, 40U, 150U, 304U}) {
        std::vector<float> x = light_from(least);
        x[kFirstPosition + 37] = brightest;
        x[kStride + kFirstPosition + 290] = brightest;
        darken(x, 0, dark);
        const std::vector<float> expected = there_and_back(kKernelsPortable.blocks, plain, x);
        for (const KernelSet* set : kernel_sets()) {
          EXPECT_EQ(there_and_back(set->blocks, plain, x), expected) << set->instruction_set;
        }
      }
    }
  }
}

TEST(IntegerKernels, LightThatIsMeasuredBeforehandHasTheSameBits) {
  const PlainBasis plain = integer_basis(9, 304);
  const std::vector<std::int8_t> basis = in_strips(plain);
  const BasisPart part = part_of(plain, 0, plain.size);
  std::vector<float> x = light_from(0.25F);
  darken(x, 100, 180);
  x.resize(3 * 336);  // whole runs
  for (const KernelSet* set : kernel_sets()) {
    SCOPED_TRACE(set->instruction_set);
    const PlanarVectors<const float> light{x.data(), 336, 3};
    std::vector<LightRun> runs(336 / LightRun::kPositions);
    set->blocks.measure_light(x.data(), 336, 336, runs.data());
    std::vector<float> without(kRankStride * kChannelLanes), with = without;
    set->blocks.bases_q8.project(basis.data(), {&part, 1}, light, nullptr,
                                 side_by_side<float>(without, 1));
    set->blocks.bases_q8.project(basis.data(), {&part, 1}, light, runs.data(),
                                 side_by_side<float>(with, 1));
    EXPECT_EQ(with, without);
  }
}

TEST(IntegerKernels, MeasuresOfLightAreTheSameInEveryInstructionSet) {
  std::vector<float> x = light_from(-0.25F);
  x.resize(3 * 336);
  std::vector<LightRun> expected(336 / LightRun::kPositions), runs = expected;
  kKernelsPortable.blocks.measure_light(x.data(), 336, 336, expected.data());
  EXPECT_GT(expected.front().largest[3], 0);
  for (const KernelSet* set : kernel_sets()) {
    set->blocks.measure_light(x.data(), 336, 336, runs.data());
    for (std::size_t k = 0; k < runs.size(); ++k) {
      EXPECT_EQ(runs[k].largest, expected[k].largest) << set->instruction_set;
      EXPECT_EQ(runs[k].sum, expected[k].sum) << set->instruction_set;
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
}  // namespace rebounce::test_basis_kernels
