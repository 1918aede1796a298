#pragma once

// Products with bases of integers of 16 or 8 bits, written once over a vector type `N` of integers.
// Included by one file per instruction set; everything is in an unnamed namespace so that no two
// sets share an instantiation.
//
// One instruction multiplies neighbouring pairs of 16-bit integers and adds the two products to a
// sum of 32 bits: twice the products of a multiply-add of floats. Bytes are widened to 16 bits as
// they are loaded. The light is rounded to integers for it, with a scale for each channel of a
// chunk of positions; so are the coefficients on the way back. The scale is the largest with which
// no sum of products can overflow: 15 bits with bytes; with values of 16 bits, 11 where the light
// is even over a chunk of 128 and up to 15 where it is not.
//
// A basis is [strip of 64 positions][rank / 4][position / 2][4 ranks][2 positions]: both ways read
// it from the first value to the last. Coefficients are sums over positions, and their pairs are
// neighbours as they are. Light is a sum over ranks: a shuffle within 128 bits makes (4 ranks)(2
// positions) into (2 positions)(4 ranks). Neither way is left with sums over all the lanes of a
// vector, which cost as much as the products where clusters are small.
//
// `N` is kWidth integers of 16 bits or half as many sums of 32: load, zero, repeat_four (four ranks
// of a channel for every position), by_position (that shuffle), add_products, add. Around the
// products it has magnitudes_of_planes and magnitudes_of_lanes, round_positions (of 16 positions)
// and CoefficientRounding, which make integers, and store_coefficients and add_positions, which
// make floats of sums. kStrip positions are what its registers have room for, kLeastSums what hides
// the latency of a sum.
//
// Integer sums do not depend on their order, and floats are converted, scaled and added in the same
// one everywhere: all instruction sets give the same bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "transfer/base/types.h"
#include "transfer/format/operator_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

constexpr std::size_t kRankGroup = HierarchicalFormat::kRankGroup;
constexpr std::size_t kBasisStrip = HierarchicalFormat::kStrip;

// Positions or ranks whose products are added as integers.
constexpr std::size_t kChunk = 128;

/// A number for each channel; the last is not used.
using ChannelFloats = std::array<float, kChannelLanes>;

/// Of the light in a chunk, the largest magnitude and the sum of all.
struct Magnitudes {
  ChannelFloats largest, sum;
};

/// The sum of magnitudes, as a power of two, with which no sum of products with values of bases can
/// overflow 32 bits.
template <typename Value>
constexpr std::uint32_t kLargestSum = 19;  // values up to 2^12
template <>
constexpr std::uint32_t kLargestSum<std::int8_t> = 24;

/// Powers of two by which light becomes integers, and which bring it back: with the largest of them
/// below 2^15 and their sum below 2^kLargestSum, sums of products stay below 2^31.
struct IntegerScales {
  ChannelFloats to, back;

  IntegerScales(const Magnitudes& light, std::uint32_t largest_sum) {
    constexpr std::uint32_t kExponent = 0x7F800000, kOne = 127U << 23;
    constexpr std::uint32_t kLargest = 14U << 23;
    constexpr std::uint32_t kDark = kOne - (100U << 23);  // anything below 2^-100 is as dark
    const auto power = [=](float magnitude) {
      return std::max(std::bit_cast<std::uint32_t>(magnitude) & kExponent, kDark);
    };
    for (std::size_t c = 0; c < kChannelLanes; ++c) {
      const std::uint32_t one = std::max(power(light.largest[c]) - kLargest,
                                         power(light.sum[c]) - ((largest_sum - 1) << 23));
      to[c] = std::bit_cast<float>(2 * kOne - one);
      back[c] = std::bit_cast<float>(one);
    }
  }
};

/// The light of a chunk of positions: of each channel (pair of positions)(4 times the pair).
struct IntegerLight {
  alignas(64) std::int16_t value[kChannelCount][kChunk * kRankGroup];
  ChannelFloats to, back;
  bool uneven;  ///< what rounding left may matter
};

// Light whose largest magnitude is more than this many times the mean is uneven: where the
// brightest patches of a chunk face nothing but the sky, what arrives comes from others, of which
// rounding to 2^-15 of the largest leaves little. notes/operator.md.
constexpr float kUneven = 8;

inline bool is_uneven(const Magnitudes& light, std::size_t count) {
  bool uneven = false;
  for (std::size_t c = 0; c < kChannelCount; ++c) {
    uneven |= light.largest[c] * static_cast<float>(count) > kUneven * light.sum[c];
  }
  return uneven;
}

template <typename N, typename Value>
REBOUNCE_INLINE inline void round_light(const float* x, std::size_t stride, std::size_t count,
                                        IntegerLight& light) {
  const Magnitudes magnitudes = N::magnitudes_of_planes(x, stride, count);
  const IntegerScales scales(magnitudes, kLargestSum<Value>);
  light.to = scales.to;
  light.back = scales.back;
  light.uneven = is_uneven(magnitudes, count);
  for (std::size_t k = 0; k < count; k += 16) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      N::round_positions(x + c * stride + k, scales.to[c], light.value[c] + k * kRankGroup);
    }
  }
}

/// What rounding left of the light of a chunk: exact, as powers of two scale it.
struct LightRest {
  alignas(64) float value[kChannelCount * kChunk];

  LightRest(const float* x, std::size_t stride, std::size_t count, const IntegerLight& light) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < count; ++k) {
        const float all = x[c * stride + k];
        value[c * kChunk + k] = all - std::nearbyint(all * light.to[c]) * light.back[c];
      }
    }
  }
};

/// Part of a basis within a strip: the values of a group of ranks, those of the next one
/// `group_step` later.
template <typename Value>
struct StripBasis {
  const Value* values;
  std::size_t group_step;
};

/// From a position of a cluster on, all groups of ranks from `group` on.
template <typename Value>
inline StripBasis<Value> strip_at(const Value* values, const BasisPart& part, std::size_t position,
                                  std::size_t group) {
  const std::size_t groups = (part.rank + kRankGroup - 1) / kRankGroup;
  const std::size_t begin = position / kBasisStrip * kBasisStrip;
  const std::size_t width = std::min(kBasisStrip, part.size - begin);
  return {values + part.values + (begin * groups + group * width + position - begin) * kRankGroup,
          width * kRankGroup};
}

/// Values of a basis.
template <typename N, typename Value>
REBOUNCE_INLINE inline N load_basis(const Value* values) {
  ask_ahead<N::kWidth * sizeof(std::int16_t)>(values);
  return N::load(values);
}

// The next functions are not inlined: their sums need all registers, which g++ 12 would otherwise
// share out among the constants of everything around them.

/// kGroups groups of ranks of `count` positions, a chunk at most, whose strips begin with `first`
/// and `second`.
template <typename N, std::size_t kGroups, typename Value>
[[gnu::noinline]] void project_groups(StripBasis<Value> first, StripBasis<Value> second,
                                      std::size_t count, const IntegerLight& light, bool add_to,
                                      float* coefficient) {
  N sum[kChannelCount][kGroups];
  unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
    unroll<kGroups>([&](auto g) REBOUNCE_INLINE { sum[c][g] = N::zero(); });
  });
  const auto add_strip = [&](StripBasis<Value> strip, std::size_t begin,
                             std::size_t end) REBOUNCE_INLINE {
    for (std::size_t k = begin; k < end; k += N::kWidth, strip.values += N::kWidth) {
      N b[kGroups];
      unroll<kGroups>([&](auto g) REBOUNCE_INLINE {
        b[g] = load_basis<N>(strip.values + g * strip.group_step);
      });
      unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
        const N l = N::load(light.value[c] + k);
        unroll<kGroups>([&](auto g)
                            REBOUNCE_INLINE { sum[c][g] = add_products(sum[c][g], b[g], l); });
      });
    }
  };
  add_strip(first, 0, std::min(count, kBasisStrip) * kRankGroup);
  add_strip(second, kBasisStrip * kRankGroup, count * kRankGroup);
  N::template store_coefficients<kGroups>(sum[0], sum[1], sum[2], light.back, add_to, coefficient);
}

/// Positions of a cluster whose light is rounded together.
struct LightChunk {
  std::size_t begin, count;
};

template <typename N, typename Value>
REBOUNCE_INLINE inline void project_chunk(const Value* values, const BasisPart& part,
                                          const LightChunk& chunk, const IntegerLight& light,
                                          bool add_to, float* coefficient) {
  const std::size_t first_group = part.first_rank / kRankGroup;
  const std::size_t groups = (part.last_rank + kRankGroup - 1) / kRankGroup - first_group;
  StripBasis<Value> first = strip_at(values, part, chunk.begin, first_group), second{};
  if (chunk.count > kBasisStrip) {
    second = strip_at(values, part, chunk.begin + kBasisStrip, first_group);
  }
  float* const to = coefficient + (part.coefficient + first_group * kRankGroup) * kChannelLanes;
  for_each_rows<4>(groups, [&]<std::size_t kGroups>(std::size_t g) {
    project_groups<N, kGroups>(first, second, chunk.count, light, add_to,
                               to + g * kRankGroup * kChannelLanes);
    first.values += kGroups * first.group_step;
    second.values += kGroups * second.group_step;
  });
}

template <typename N, typename Value>
void project_integers(const Value* values, std::span<const BasisPart> parts,
                      PlanarVectors<const float> x, Coefficients<float> coefficient) {
  IntegerLight light;
  for (const BasisPart& part : parts) {
    for (std::size_t v = 0; v < x.count; v += kChannelCount) {
      const float* const from = x.data + v * x.stride + part.position;
      float* const to = coefficient.data + v / kChannelCount * coefficient.stride;
      for (std::size_t k = 0; k < part.size; k += kChunk) {
        const LightChunk chunk{k, std::min(part.size - k, kChunk)};
        round_light<N, Value>(from + k, x.stride, chunk.count, light);
        project_chunk<N>(values, part, chunk, light, k > 0, to);
        if (light.uneven && !part.cluster_coefficients) {
          const LightRest rest(from + k, x.stride, chunk.count, light);
          round_light<N, Value>(rest.value, kChunk, chunk.count, light);
          project_chunk<N>(values, part, chunk, light, true, to);
        }
      }
    }
  }
}

/// Ranks within a chunk.
struct RankRange {
  std::size_t begin, end;
};

/// The coefficients of a chunk of ranks: of each group (channel)(rank).
struct IntegerCoefficients {
  static constexpr std::size_t kGroupSize = kRankGroup * kChannelLanes;
  alignas(64) std::int16_t value[kChunk / kRankGroup * kGroupSize];
  ChannelFloats back;
  std::size_t group_count;
};

/// Of the ranks within a chunk; those of its groups that are not among them are zero.
template <typename N, typename Value>
REBOUNCE_INLINE inline void round_coefficients(const float* from, RankRange ranks,
                                               IntegerCoefficients& to) {
  constexpr std::size_t kGroupSize = IntegerCoefficients::kGroupSize;
  const IntegerScales scales(N::magnitudes_of_lanes(from + ranks.begin * kChannelLanes,
                                                    (ranks.end - ranks.begin) * kChannelLanes),
                             kLargestSum<Value>);
  to.back = scales.back;
  to.group_count = (ranks.end + kRankGroup - 1) / kRankGroup;
  const typename N::CoefficientRounding round(scales.to);
  for (std::size_t g = 0; g < to.group_count; ++g) {
    round(from + g * kGroupSize, to.value + g * kGroupSize);
  }
  if (ranks.begin % kRankGroup != 0) {
    const RankRange wanted{ranks.begin % kRankGroup, std::min(ranks.end, kRankGroup)};
    round.some(from, wanted, to.value);
  }
  if (ranks.end % kRankGroup != 0) {
    const std::size_t last = (to.group_count - 1) * kRankGroup;
    const RankRange wanted{std::max(ranks.begin, last) - last, ranks.end - last};
    round.some(from + last * kChannelLanes, wanted, to.value + last * kChannelLanes);
  }
}

/// y of kWide vectors of positions; groups of ranks are dealt out among kSplit sums, so that there
/// are N::kLeastSums of them or more.
template <typename N, std::size_t kWide, typename Value>
[[gnu::noinline]] void expand_integer_strip(StripBasis<Value> strip,
                                            const IntegerCoefficients& coefficient, float* y,
                                            std::size_t y_stride) {
  constexpr std::size_t kSums = kChannelCount * kWide;
  constexpr std::size_t kSplit = std::max<std::size_t>(N::kLeastSums / kSums, 1);
  N sum[kSplit][kChannelCount][kWide];
  unroll<kSplit>([&](auto s) REBOUNCE_INLINE {
    unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
      unroll<kWide>([&](auto w) REBOUNCE_INLINE { sum[s][c][w] = N::zero(); });
    });
  });
  const auto add_group = [&](std::size_t g, auto s) REBOUNCE_INLINE {
    const std::int16_t* const group = coefficient.value + g * IntegerCoefficients::kGroupSize;
    N four[kChannelCount];
    unroll<kChannelCount>(
        [&](auto c) REBOUNCE_INLINE { four[c] = N::repeat_four(group + c * kRankGroup); });
    unroll<kWide>([&](auto w) REBOUNCE_INLINE {
      const N b = load_basis<N>(strip.values + w * N::kWidth).by_position();
      unroll<kChannelCount>(
          [&](auto c) REBOUNCE_INLINE { sum[s][c][w] = add_products(sum[s][c][w], b, four[c]); });
    });
    strip.values += strip.group_step;
  };
  std::size_t g = 0;
  for (; g + kSplit <= coefficient.group_count; g += kSplit) {
    unroll<kSplit>([&](auto s) REBOUNCE_INLINE { add_group(g + s, s); });
  }
  for (; g < coefficient.group_count; ++g) {
    add_group(g, std::integral_constant<std::size_t, 0>{});
  }
  unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
    unroll<kWide>([&](auto w) REBOUNCE_INLINE {
      unroll<kSplit - 1>(
          [&](auto s) REBOUNCE_INLINE { sum[0][c][w] = add(sum[0][c][w], sum[s + 1][c][w]); });
    });
    N::template add_positions<kWide>(sum[0][c], coefficient.back[c], y + c * y_stride);
  });
}

/// The chunk of ranks from `first_rank` on.
template <typename N, typename Value>
REBOUNCE_INLINE inline void expand_chunk(const Value* values, const BasisPart& part,
                                         std::size_t first_rank,
                                         const IntegerCoefficients& coefficient, float* y,
                                         std::size_t y_stride) {
  float* const to = y + part.position;
  for (std::size_t k = part.first_place; k < part.last_place;) {
    const std::size_t strip_end = (k / kBasisStrip + 1) * kBasisStrip;
    const std::size_t end = std::min<std::size_t>(part.last_place, strip_end);
    const auto add_strips = [&]<std::size_t kSize>() {
      for (; k + kSize <= end; k += kSize) {
        expand_integer_strip<N, kSize * kRankGroup / N::kWidth>(
            strip_at(values, part, k, first_rank / kRankGroup), coefficient, to + k, y_stride);
      }
    };
    if constexpr (N::kStrip >= 64) add_strips.template operator()<64>();
    if constexpr (N::kStrip >= 48) add_strips.template operator()<48>();
    if constexpr (N::kStrip >= 32) add_strips.template operator()<32>();
    add_strips.template operator()<std::min<std::size_t>(N::kStrip, 16)>();
  }
}

template <typename N, typename Value>
void expand_integers(const Value* values, std::span<const BasisPart> parts,
                     Coefficients<const float> coefficient, PlanarVectors<float> y) {
  IntegerCoefficients rounded;
  for (const BasisPart& part : parts) {
    for (std::size_t v = 0; v < y.count; v += kChannelCount) {
      const float* const from = coefficient.data + v / kChannelCount * coefficient.stride +
                                std::size_t{part.coefficient} * kChannelLanes;
      const std::size_t first_group = part.first_rank / kRankGroup;
      for (std::size_t r = first_group * kRankGroup; r < part.last_rank; r += kChunk) {
        const RankRange ranks{std::max<std::size_t>(part.first_rank, r) - r,
                              std::min(part.last_rank - r, kChunk)};
        round_coefficients<N, Value>(from + r * kChannelLanes, ranks, rounded);
        expand_chunk<N>(values, part, r, rounded, y.data + v * y.stride, y.stride);
      }
    }
  }
}

}  // namespace
}  // namespace rebounce
