#pragma once

// Products with bases in 8-bit integers, written once over a set of vectors `N` of integers.
// One file per instruction set includes this. Everything is in an unnamed namespace, so that no two
// sets share an instantiation.
//
// A basis is [strip of 64 positions][rank / 4][position / 4][4 ranks][4 positions] in bytes;
// projection and expansion both read it from the first value to the last.
//
// Light is rounded to integers of 15 bits and a sign, with one scale per channel and chunk of 128
// positions; where it is uneven, 15 bits more are projected after these. A coefficient is a sum
// over positions, four of which are neighbours: 8-bit products take the two bytes of the light one
// by one, 16-bit products take both at once.
//
// On the way back coefficients are rounded to 16 bits, with one scale per channel and chunk of 128
// ranks, the largest power of two for which no sum can overflow. Light is a sum over ranks: a
// shuffle within 128 bits turns (4 ranks)(4 positions) into (4 positions)(4 ranks), and shifts give
// the words of even and of odd ranks. Groups of ranks whose coefficients round to nothing are left
// out, and so are positions without light: the bits are the same.
//
// `N` has vectors of 32-bit sums: Sum, zero, add. Projection: kProjected positions at a time, of
// kProjectedGroups groups of ranks; Ranks, load_ranks; Light, load_light; ProjectedSum, first_sum,
// add_projected; Rounding (of 16 positions), store_coefficients; measure_run. Expansion: kExpanded
// positions in a vector; Positions, load_positions; Pair, broadcast_pair; add_products;
// CoefficientRounding, add_to_light; magnitudes_of_lanes. kStrip: positions whose sums fit the
// registers. kLeastSums: independent sums that hide the latency of add_products.
//
// Integer sums do not depend on their order. Floats are converted, scaled and added in one fixed
// order. So all instruction sets give the same bits.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "rebounce/types.h"
#include "transfer/format/operator_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

constexpr std::size_t kRankGroup = HierarchicalFormat::kRankGroup;
constexpr std::size_t kBasisStrip = HierarchicalFormat::kStrip;
constexpr std::size_t kRun = LightRun::kPositions;

// Positions or ranks whose products are summed in integers.
constexpr std::size_t kChunk = 128;

/// One number per channel; the last is unused.
using ChannelFloats = std::array<float, kChannelLanes>;

/// The same, to compute with all at once.
using FourFloats = float __attribute__((vector_size(sizeof(ChannelFloats))));

/// The largest magnitude in a chunk of coefficients, and the sum of all magnitudes.
struct Magnitudes {
  ChannelFloats largest, sum;
};

/// Base-2 logarithm of the largest sum of magnitudes for which no sum of products with basis values
/// can overflow 32 bits.
constexpr std::uint32_t kLargestSum = 24;

/// Powers of two that scale coefficients to integers and back. The largest integer stays below 2^15
/// and the sum of all below 2^kLargestSum, so sums of products stay below 2^31.
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

/// Light below this is as dark as none.
constexpr float kDark = 0x1p-97F;  // integers of 30 bits over it stay below the largest float

// Light is uneven if its largest magnitude exceeds this many times the mean, and this many times
// the mean of its darkest run that has any. The brightest patches of a chunk may see only the sky;
// then the others send all that arrives, and rounding to 2^-15 of the largest value leaves few bits
// of them (lab/038, lab/079).
constexpr float kUneven = 8, kDeep = 1024;

// Bits of light that are projected at a time, without the sign.
constexpr int kWordBits = 15;

/// How the light of a chunk is rounded.
struct LightRounding {
  bool is_uneven;                   ///< whether integers have two words, the higher one first
  bool is_signed;                   ///< whether the first word is
  bool is_dark;                     ///< no channel has light
  std::size_t first_run, last_run;  ///< the runs [first, last) that have light
  ChannelFloats to, back;           ///< to integers and from them

  LightRounding(const LightRun* runs, std::size_t run_count, bool of_cluster_coefficients)
      : is_uneven(false), first_run(run_count), last_run(0) {
    constexpr float kNone = std::numeric_limits<float>::infinity();
    const FourFloats none{kNone, kNone, kNone, kNone}, zero{};
    FourFloats all_largest{}, all_sum{}, all_least = none;  // the least sum of a run that has light
    for (std::size_t k = 0; k < run_count; ++k) {
      const auto largest = std::bit_cast<FourFloats>(runs[k].largest);
      const auto sum = std::bit_cast<FourFloats>(runs[k].sum);
      const FourFloats lit_sum = sum > zero ? sum : none;
      all_largest = largest > all_largest ? largest : all_largest;
      all_sum += sum;
      all_least = lit_sum < all_least ? lit_sum : all_least;
      if (!any(largest)) continue;
      first_run = std::min(first_run, k);
      last_run = k + 1;
    }
    is_dark = last_run == 0;
    const auto largest = std::bit_cast<ChannelFloats>(all_largest);
    is_signed = of_cluster_coefficients || largest[kChannelCount] > 0;
    if (!of_cluster_coefficients) {
      const auto sum = std::bit_cast<ChannelFloats>(all_sum);
      const auto least = std::bit_cast<ChannelFloats>(all_least);
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        is_uneven |= largest[c] * static_cast<float>(run_count * kRun) > kUneven * sum[c] &&
                     largest[c] * kRun > kDeep * least[c];
      }
    }
    // Of two words the largest integer is a little less, as floats are coarse there.
    const float limit = is_uneven ? 0x3FFFFF00 : 0x7FFF;
    const FourFloats dark{kDark, kDark, kDark, kDark};
    to = std::bit_cast<ChannelFloats>(all_largest > dark ? limit / all_largest : zero);
    back = std::bit_cast<ChannelFloats>(all_largest > dark ? all_largest / limit : zero);
  }

 private:
  /// Whether any of four magnitudes is above zero.
  static bool any(FourFloats magnitudes) {
    const auto bits = std::bit_cast<std::array<std::uint64_t, 2>>(magnitudes);
    return (bits[0] | bits[1]) != 0;
  }
};

/// One word of the rounded light of a chunk, as N::load_light reads it.
template <typename N>
struct LightWords {
  alignas(64) std::uint8_t value[kChannelCount][kChunk * N::kLightBytes];
  std::array<std::int32_t, kChannelCount> sum;  ///< of the highest bytes of signed words
  ChannelFloats back;
  bool is_signed;
};

/// Rounds a word of the runs that have light.
template <typename N>
REBOUNCE_INLINE inline void round_light(const float* x, std::size_t stride,
                                        const LightRounding& rounding, bool is_first,
                                        LightWords<N>& light) {
  const int below = is_first && rounding.is_uneven ? kWordBits : 0;
  light.is_signed = rounding.is_signed && is_first;
  light.sum = {};
  for (std::size_t c = 0; c < kChannelCount; ++c) {
    light.back[c] = rounding.back[c] * static_cast<float>(1 << below);
    const typename N::Rounding round(rounding.to[c], below, light.is_signed);
    for (std::size_t k = rounding.first_run; k < rounding.last_run; ++k) {
      light.sum[c] += round(x + c * stride + k * kRun, light.value[c] + k * kRun * N::kLightBytes);
    }
  }
}

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

// The next functions are not inlined: their sums need all registers. g++ 12 would use some of them
// for constants of the surrounding code.

/// Positions of a chunk: [begin, end) within a strip that begins at `strip`.
struct StripPositions {
  std::size_t strip, begin, end;
};

/// Projects kGroups groups of ranks over the positions of a chunk in its two strips.
template <typename N, std::size_t kGroups, bool kSigned>
[[gnu::noinline]] void project_groups(const StripBasis (&bases)[2],
                                      const StripPositions (&positions)[2],
                                      const LightWords<N>& light, bool add_to, float* coefficient) {
  typename N::ProjectedSum sum[kChannelCount][kGroups];
  unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
    const auto first = N::template first_sum<kSigned>(light.sum[c]);
    unroll<kGroups>([&](auto g) REBOUNCE_INLINE { sum[c][g] = first; });
  });
  for (std::size_t s = 0; s < 2; ++s) {
    const std::int8_t* values =
        bases[s].values + (positions[s].begin - positions[s].strip) * kRankGroup;
    for (std::size_t k = positions[s].begin; k < positions[s].end;
         k += N::kProjected, values += N::kProjected * kRankGroup) {
      typename N::Ranks b[kGroups];
      unroll<kGroups>([&](auto g) REBOUNCE_INLINE {
        const std::int8_t* const at = values + g * bases[s].group_step;
        prefetch_ahead<N::kProjected * kRankGroup>(at);
        b[g] = N::load_ranks(at);
      });
      unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
        const typename N::Light l = N::load_light(light.value[c], k);
        unroll<kGroups>([&](auto g) REBOUNCE_INLINE {
          sum[c][g] = N::template add_projected<kSigned>(sum[c][g], b[g], l);
        });
      });
    }
  }
  N::template store_coefficients<kGroups>(sum[0], sum[1], sum[2], light.back, add_to, coefficient);
}

/// The groups of ranks of a part.
struct RankGroups {
  std::size_t first, count;

  explicit RankGroups(const BasisPart& part)
      : first(part.first_rank / kRankGroup),
        count((part.last_rank + kRankGroup - 1) / kRankGroup - first) {}
};

/// Projects the chunk of positions from `begin` on.
template <typename N>
REBOUNCE_INLINE inline void project_chunk(const std::int8_t* values, const BasisPart& part,
                                          std::size_t begin, const LightRounding& rounding,
                                          const LightWords<N>& light, bool add_to,
                                          float* coefficient) {
  const RankGroups all(part);
  const std::size_t lit_begin = rounding.first_run * kRun, lit_end = rounding.last_run * kRun;
  const StripPositions positions[2] = {{0, lit_begin, std::min(lit_end, kBasisStrip)},
                                       {kBasisStrip, std::max(lit_begin, kBasisStrip), lit_end}};
  StripBasis bases[2] = {};
  for (std::size_t s = 0; s < 2; ++s) {
    if (positions[s].begin < positions[s].end) {
      bases[s] = strip_at(values, part, begin + positions[s].strip, all.first);
    }
  }
  const auto project = [&]<bool kSigned>() REBOUNCE_INLINE {
    for_each_rows<N::kProjectedGroups>(all.count, [&]<std::size_t kGroups>(std::size_t g) {
      project_groups<N, kGroups, kSigned>(bases, positions, light, add_to,
                                          coefficient + g * kRankGroup * kChannelLanes);
      for (StripBasis& basis : bases) basis.values += kGroups * basis.group_step;
    });
  };
  if (light.is_signed) {
    project.template operator()<true>();
  } else {
    project.template operator()<false>();
  }
}

/// Measures the runs of one light, three planes of `count` positions.
template <typename N>
void measure_light(const float* x, std::size_t stride, std::size_t count, LightRun* runs) {
  for (std::size_t k = 0; k < count; k += kRun, ++runs) N::measure_run(x + k, stride, *runs);
}

template <typename N>
void project_part(const std::int8_t* values, const BasisPart& part, const float* x,
                  std::size_t stride, const LightRun* runs, float* coefficient) {
  const RankGroups groups(part);
  float* const to = coefficient + (part.coefficient + groups.first * kRankGroup) * kChannelLanes;
  LightWords<N> light;
  std::array<LightRun, kChunk / kRun> measured;
  bool any = false;
  for (std::size_t k = 0; k < part.size; k += kChunk) {
    const std::size_t count = std::min(part.size - k, kChunk);
    const LightRun* of_chunk = measured.data();
    if (runs != nullptr) {
      of_chunk = runs + (part.position + k) / kRun;
    } else {
      measure_light<N>(x + part.position + k, stride, count, measured.data());
    }
    const LightRounding rounding(of_chunk, count / kRun, part.over_cluster_coefficients);
    if (rounding.is_dark) continue;
    for (const bool is_first : {true, false}) {
      if (!is_first && !rounding.is_uneven) break;
      round_light<N>(x + part.position + k, stride, rounding, is_first, light);
      project_chunk<N>(values, part, k, rounding, light, any, to);
      any = true;
    }
  }
  if (!any) std::fill_n(to, groups.count * kRankGroup * kChannelLanes, 0.0F);
}

template <typename N>
void project_integers(const std::int8_t* values, std::span<const BasisPart> parts,
                      PlanarVectors<const float> x, const LightRun* runs,
                      Coefficients<float> coefficient) {
  for (const BasisPart& part : parts) {
    for (std::size_t v = 0; v < x.count; v += kChannelCount) {
      const LightRun* const of_light =
          runs == nullptr ? nullptr : runs + v / kChannelCount * (x.stride / kRun);
      project_part<N>(values, part, x.data + v * x.stride, x.stride, of_light,
                      coefficient.data + v / kChannelCount * coefficient.stride);
    }
  }
}

/// Ranks [begin, end) within a chunk.
struct RankRange {
  std::size_t begin, end;
};

/// Rounded coefficients of the groups of a chunk of ranks that have any: each is (channel)(4
/// ranks), the even ranks first.
struct IntegerCoefficients {
  static constexpr std::size_t kGroupSize = kRankGroup * kChannelLanes;
  alignas(64) std::int16_t value[kChunk / kRankGroup * kGroupSize];
  std::array<std::uint8_t, kChunk / kRankGroup> group;  ///< which ones these are
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
  const typename N::CoefficientRounding round(scales.to);
  std::size_t count = 0;  // in a register
  const auto add = [&](std::size_t g, const auto& round_group) REBOUNCE_INLINE {
    const bool any = round_group(from + g * kGroupSize, to.value + count * kGroupSize);
    to.group[count] = static_cast<std::uint8_t>(g);
    count += any ? 1 : 0;
  };
  const auto add_some = [&](std::size_t g) REBOUNCE_INLINE {
    const std::size_t first = g * kRankGroup;
    const RankRange wanted{std::max(ranks.begin, first) - first,
                           std::min(ranks.end - first, kRankGroup)};
    add(g, [&](const float* group, std::int16_t* rounded)
               REBOUNCE_INLINE { return round.some(group, wanted, rounded); });
  };
  const std::size_t whole = ranks.end / kRankGroup;
  std::size_t g = 0;
  if (ranks.begin > 0 && whole > 0) add_some(g++);
  for (; g < whole; ++g) add(g, round);
  if (ranks.end % kRankGroup != 0) add_some(g);
  to.group_count = count;
}

/// Computes y at kWide vectors of positions. Groups of ranks are divided among kSplit partial sums,
/// so that at least N::kLeastSums sums are independent.
template <typename N, std::size_t kWide>
[[gnu::noinline]] void expand_integer_strip(StripBasis strip,
                                            const IntegerCoefficients& coefficient, float* y,
                                            std::size_t y_stride) {
  constexpr std::size_t kSums = kChannelCount * kWide;
  constexpr std::size_t kSplit = std::max<std::size_t>(N::kLeastSums / kSums, 1);
  typename N::Sum sum[kSplit][kChannelCount][kWide];
  unroll<kSplit>([&](auto s) REBOUNCE_INLINE {
    unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
      unroll<kWide>([&](auto w) REBOUNCE_INLINE { sum[s][c][w] = N::zero(); });
    });
  });
  const auto add_group = [&](std::size_t g, auto s) REBOUNCE_INLINE {
    const std::int16_t* const group = coefficient.value + g * IntegerCoefficients::kGroupSize;
    const std::int8_t* const values = strip.values + coefficient.group[g] * strip.group_step;
    typename N::Pair even[kChannelCount], odd[kChannelCount];
    unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
      even[c] = N::broadcast_pair(group + c * kRankGroup);
      odd[c] = N::broadcast_pair(group + c * kRankGroup + 2);
    });
    unroll<kWide>([&](auto w) REBOUNCE_INLINE {
      const std::int8_t* const at = values + w * N::kExpanded * kRankGroup;
      prefetch_ahead<N::kExpanded * kRankGroup>(at);
      const typename N::Positions b = N::load_positions(at);
      unroll<kChannelCount>([&](auto c) REBOUNCE_INLINE {
        sum[s][c][w] = N::add_products(sum[s][c][w], b.even, even[c]);
        sum[s][c][w] = N::add_products(sum[s][c][w], b.odd, odd[c]);
      });
    });
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
          [&](auto s) REBOUNCE_INLINE { sum[0][c][w] = N::add(sum[0][c][w], sum[s + 1][c][w]); });
      N::add_to_light(sum[0][c][w], coefficient.back[c], y + c * y_stride + w * N::kExpanded);
    });
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
        expand_integer_strip<N, kSize / N::kExpanded>(
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
        if (rounded.group_count > 0)
          expand_chunk<N>(values, part, r, rounded, y.data + v * y.stride, y.stride);
      }
    }
  }
}

}  // namespace
}  // namespace rebounce
