#pragma once

// Products with bases in 8-bit integers, written once over a vector type `N` of integers.
// One file per instruction set includes this. Everything is in an unnamed namespace, so that no two
// sets share an instantiation.
//
// One instruction multiplies neighbouring pairs of 16-bit integers and adds the two products to a
// 32-bit sum: twice the products of a float multiply-add. Values are widened as they are
// loaded. Light is rounded to integers, with one scale per channel and chunk of positions;
// coefficients are rounded in the same way on the way back. The scale is the largest for which no
// sum of products can overflow. This leaves 15 bits.
//
// A basis is [strip of 64 positions][rank / 4][position / 2][4 ranks][2 positions]; projection and
// expansion both read it from the first value to the last. Coefficients are sums over positions:
// pairs of positions are neighbours already. Light is a sum over ranks: a shuffle within 128 bits
// turns (4 ranks)(2 positions) into (2 positions)(4 ranks). Neither needs sums over all lanes of a
// vector, which would cost as much as the products in small clusters.
//
// `N` is kWidth 16-bit integers or half as many 32-bit sums. Products: load, zero, repeat_four
// (four ranks of a channel, repeated for every position), by_position (that shuffle), add_products,
// add. Rounding: magnitudes_of_planes, magnitudes_of_lanes, round_positions (16 positions) and
// CoefficientRounding. Results as floats: store_coefficients and add_positions. kStrip: positions
// whose sums fit the registers. kLeastSums: independent sums that hide the latency of add_products.
//
// Integer sums do not depend on their order. Floats are converted, scaled and added in one fixed
// order. So all instruction sets give the same bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rebounce/types.h"
#include "transfer/format/operator_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

constexpr std::size_t kRankGroup = HierarchicalFormat::kRankGroup;
constexpr std::size_t kBasisStrip = HierarchicalFormat::kStrip;

// Positions or ranks whose products are summed in integers.
constexpr std::size_t kChunk = 128;

/// One number per channel; the last is unused.
using ChannelFloats = std::array<float, kChannelLanes>;

/// The largest magnitude in a chunk of light, and the sum of all magnitudes.
struct Magnitudes {
  ChannelFloats largest, sum;
};

/// Base-2 logarithm of the largest sum of magnitudes for which no sum of products with basis values
/// can overflow 32 bits.
constexpr std::uint32_t kLargestSum = 24;

/// Powers of two that scale light to integers and back. The largest integer stays below 2^15 and
/// the sum of all below 2^kLargestSum, so sums of products stay below 2^31.
struct IntegerScales {
  ChannelFloats to, back;

  explicit IntegerScales(const Magnitudes& light) {
    constexpr std::uint32_t kExponent = 0x7F800000, kOne = 127U << 23;
    constexpr std::uint32_t kLargest = 14U << 23;
    constexpr std::uint32_t kDark = kOne - (100U << 23);  // anything below 2^-100 is as dark
    const auto power = [=](float magnitude) {
      return std::max(std::bit_cast<std::uint32_t>(magnitude) & kExponent, kDark);
    };
    for (std::size_t c = 0; c < kChannelLanes; ++c) {
      const std::uint32_t one = std::max(power(light.largest[c]) - kLargest,
                                         power(light.sum[c]) - ((kLargestSum - 1) << 23));
      to[c] = std::bit_cast<float>(2 * kOne - one);
      back[c] = std::bit_cast<float>(one);
    }
  }
};

/// Rounded light of a chunk of positions; each channel holds every pair of positions four times.
struct IntegerLight {
  alignas(64) std::int16_t value[kChannelCount][kChunk * kRankGroup];
  ChannelFloats to, back;
  bool uneven;  ///< whether the rounding error may matter
};

// Light is uneven if its largest magnitude exceeds this many times the mean. The brightest patches
// of a chunk may see only the sky; then the others send all that arrives, and rounding to 2^-15 of
// the largest value leaves few bits of them (lab/038).
constexpr float kUneven = 8;

inline bool is_uneven(const Magnitudes& light, std::size_t count) {
  bool uneven = false;
  for (std::size_t c = 0; c < kChannelCount; ++c) {
    uneven |= light.largest[c] * static_cast<float>(count) > kUneven * light.sum[c];
  }
  return uneven;
}

template <typename N>
REBOUNCE_INLINE inline void round_light(const float* x, std::size_t stride, std::size_t count,
                                        IntegerLight& light) {
  const Magnitudes magnitudes = N::magnitudes_of_planes(x, stride, count);
  const IntegerScales scales(magnitudes);
  light.to = scales.to;
  light.back = scales.back;
  light.uneven = is_uneven(magnitudes, count);
  for (std::size_t k = 0; k < count; k += 16) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      N::round_positions(x + c * stride + k, scales.to[c], light.value[c] + k * kRankGroup);
    }
  }
}

/// The rounding error of the light of a chunk; exact, because the scales are powers of two.
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

/// Part of a basis within a strip: the values of one group of ranks. The next group is `group_step`
/// values later.
struct StripBasis {
  const std::int8_t* values;
  std::size_t group_step;
};

/// The part of a basis from a position of the cluster on, beginning with rank group `group`.
inline StripBasis strip_at(const std::int8_t* values, const BasisPart& part, std::size_t position,
                           std::size_t group) {
  const std::size_t groups = (part.rank + kRankGroup - 1) / kRankGroup;
  const std::size_t begin = position / kBasisStrip * kBasisStrip;
  const std::size_t width = std::min(kBasisStrip, part.size - begin);
  return {values + part.values + (begin * groups + group * width + position - begin) * kRankGroup,
          width * kRankGroup};
}

/// Loads values of a basis, and prefetches those that follow later.
template <typename N>
REBOUNCE_INLINE inline N load_basis(const std::int8_t* values) {
  prefetch_ahead<N::kWidth * sizeof(std::int16_t)>(values);
  return N::load(values);
}

// The next functions are not inlined: their sums need all registers. g++ 12 would use some of them
// for constants of the surrounding code.

/// Projects kGroups groups of ranks over `count` positions, at most a chunk; `first` and `second`
/// are its two strips.
template <typename N, std::size_t kGroups>
[[gnu::noinline]] void project_groups(StripBasis first, StripBasis second, std::size_t count,
                                      const IntegerLight& light, bool add_to, float* coefficient) {
  N sum[kChannelCount][kGroups];
  unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
    unroll<kGroups>([&](auto g) REBOUNCE_INLINE { sum[c][g] = N::zero(); });
  });
  const auto add_strip = [&](StripBasis strip, std::size_t begin, std::size_t end) REBOUNCE_INLINE {
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

/// Positions of a cluster that are rounded with one scale.
struct LightChunk {
  std::size_t begin, count;
};

template <typename N>
REBOUNCE_INLINE inline void project_chunk(const std::int8_t* values, const BasisPart& part,
                                          const LightChunk& chunk, const IntegerLight& light,
                                          bool add_to, float* coefficient) {
  const std::size_t first_group = part.first_rank / kRankGroup;
  const std::size_t groups = (part.last_rank + kRankGroup - 1) / kRankGroup - first_group;
  StripBasis first = strip_at(values, part, chunk.begin, first_group), second{};
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

template <typename N>
void project_integers(const std::int8_t* values, std::span<const BasisPart> parts,
                      PlanarVectors<const float> x, Coefficients<float> coefficient) {
  IntegerLight light;
  for (const BasisPart& part : parts) {
    for (std::size_t v = 0; v < x.count; v += kChannelCount) {
      const float* const from = x.data + v * x.stride + part.position;
      float* const to = coefficient.data + v / kChannelCount * coefficient.stride;
      for (std::size_t k = 0; k < part.size; k += kChunk) {
        const LightChunk chunk{k, std::min(part.size - k, kChunk)};
        round_light<N>(from + k, x.stride, chunk.count, light);
        project_chunk<N>(values, part, chunk, light, k > 0, to);
        if (light.uneven && !part.over_cluster_coefficients) {
          const LightRest rest(from + k, x.stride, chunk.count, light);
          round_light<N>(rest.value, kChunk, chunk.count, light);
          project_chunk<N>(values, part, chunk, light, true, to);
        }
      }
    }
  }
}

/// Ranks [begin, end) within a chunk.
struct RankRange {
  std::size_t begin, end;
};

/// Rounded coefficients of a chunk of ranks; each group is (channel)(rank).
struct IntegerCoefficients {
  static constexpr std::size_t kGroupSize = kRankGroup * kChannelLanes;
  alignas(64) std::int16_t value[kChunk / kRankGroup * kGroupSize];
  ChannelFloats back;
  std::size_t group_count;
};

/// Rounds the coefficients of `ranks`; the other ranks of their groups become zero.
template <typename N>
REBOUNCE_INLINE inline void round_coefficients(const float* from, RankRange ranks,
                                               IntegerCoefficients& to) {
  constexpr std::size_t kGroupSize = IntegerCoefficients::kGroupSize;
  const IntegerScales scales(N::magnitudes_of_lanes(from + ranks.begin * kChannelLanes,
                                                    (ranks.end - ranks.begin) * kChannelLanes));
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

/// Computes y at kWide vectors of positions. Groups of ranks are divided among kSplit partial sums,
/// so that at least N::kLeastSums sums are independent.
template <typename N, std::size_t kWide>
[[gnu::noinline]] void expand_integer_strip(StripBasis strip,
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

/// Expands the chunk of ranks from `first_rank` on.
template <typename N>
REBOUNCE_INLINE inline void expand_chunk(const std::int8_t* values, const BasisPart& part,
                                         std::size_t first_rank,
                                         const IntegerCoefficients& coefficient, float* y,
                                         std::size_t y_stride) {
  float* const to = y + part.position;
  for (std::size_t k = part.first_offset; k < part.last_offset;) {
    const std::size_t strip_end = (k / kBasisStrip + 1) * kBasisStrip;
    const std::size_t end = std::min<std::size_t>(part.last_offset, strip_end);
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

template <typename N>
void expand_integers(const std::int8_t* values, std::span<const BasisPart> parts,
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
        round_coefficients<N>(from + r * kChannelLanes, ranks, rounded);
        expand_chunk<N>(values, part, r, rounded, y.data + v * y.stride, y.stride);
      }
    }
  }
}

}  // namespace
}  // namespace rebounce
