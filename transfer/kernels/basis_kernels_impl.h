#pragma once

// Products with bases in f32 and f16, written once over a vector type `V` (vector_load.h). One file
// per instruction set includes this. Everything is in an unnamed namespace, so that no two sets
// share an instantiation.
//
// Wherever possible twelve sums are kept in registers: enough to hide the latency of multiply-adds,
// and as many as AVX2 has room for. Each loaded value is used for the three channels of a light, or
// of two lights if there are enough registers.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rebounce/types.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

constexpr std::size_t kChannels = kChannelCount;

/// Calls work.template operator()<vectors>(first) for groups of vectors: the channels of two lights
/// if V has registers for their sums, otherwise of one.
template <typename V, typename Work>
REBOUNCE_INLINE inline void for_each_group(std::size_t vector_count, const Work& work) {
  std::size_t v = 0;
  if constexpr (V::kLights == 2) {
    for (; v + 2 * kChannels <= vector_count; v += 2 * kChannels) {
      work.template operator()<2 * kChannels>(v);
    }
  }
  for (; v < vector_count; v += kChannels) work.template operator()<kChannels>(v);
}

/// Returns the sums over the lanes of kCount <= 4 vectors, in the first kCount lanes.
template <std::size_t kCount, typename V>
REBOUNCE_INLINE inline auto sums_of(const V (&sum)[kCount]) {
  if constexpr (kCount == 4) {
    return V::sums(sum[0], sum[1], sum[2], sum[3]);
  } else if constexpr (kCount == 3) {
    return V::sums(sum[0], sum[1], sum[2], V::zero());
  } else if constexpr (kCount == 2) {
    return V::sums(sum[0], sum[1], V::zero(), V::zero());
  } else {
    return V::sums(sum[0], V::zero(), V::zero(), V::zero());
  }
}

/// Stores the sums over the lanes of kRows vectors for three channels; the channels of a row are
/// neighbours.
template <std::size_t kRows, typename V>
REBOUNCE_INLINE inline void store_sums_side_by_side(const V (&red)[kRows], const V (&green)[kRows],
                                                    const V (&blue)[kRows], float* p) {
  if constexpr (kRows == 4 && V::kWidth == 4 * kChannelLanes) {
    V::sums_side_by_side(red, green, blue).store(p);
  } else {
    store_side_by_side<kRows>(sums_of(red), sums_of(green), sums_of(blue), p);
  }
}

/// Offset of vector v, one channel of one light, among the coefficients of a rank.
constexpr std::size_t lane_of(std::size_t v, std::size_t light_stride) {
  return v / kChannels * light_stride + v % kChannels;
}

/// Loads values of bases and dense blocks, which are read in order.
template <typename V, typename Value>
REBOUNCE_INLINE inline V load_ahead(const Value* values) {
  prefetch_ahead<V::kWidth * sizeof(float)>(values);
  return load_values<V>(values);
}

/// Multiplies kRows rows of `size` values with kVectors vectors. Lanes are not yet summed.
template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void multiply_rows(const Value* rows, std::size_t size, const float* x,
                                          std::size_t x_stride, V (&sum)[kVectors][kRows]) {
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = V::zero(); });
  });
  for (std::size_t k = 0; k < size; k += V::kWidth) {
    V b[kRows];
    unroll<kRows>([&](auto r) REBOUNCE_INLINE { b[r] = load_ahead<V>(rows + r * size + k); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V xv = V::load(x + v * x_stride + k);
      unroll<kRows>([&](auto r) REBOUNCE_INLINE { sum[v][r] = multiply_add(b[r], xv, sum[v][r]); });
    });
  }
}

template <typename V, std::size_t kRows, std::size_t kVectors, typename Value>
REBOUNCE_INLINE inline void project_rows(const Value* basis, std::size_t size, const float* x,
                                         std::size_t x_stride, float* coefficient,
                                         std::size_t light_stride) {
  V sum[kVectors][kRows];
  multiply_rows<V, kRows, kVectors>(basis, size, x, x_stride, sum);
  unroll<kVectors / kChannels>([&](auto l) REBOUNCE_INLINE {
    constexpr std::size_t kFirst = l * kChannels;
    store_sums_side_by_side<kRows>(sum[kFirst], sum[kFirst + 1], sum[kFirst + 2],
                                   coefficient + l * light_stride);
  });
}

template <typename V, typename Value>
void project(const Value* values, std::span<const BasisPart> parts, PlanarVectors<const float> x,
             const LightRun* /*runs*/, Coefficients<float> coefficient) {
  for (const BasisPart& part : parts) {
    const Value* const basis = values + part.values + std::size_t{part.first_rank} * part.size;
    const float* const from = x.data + part.position;
    float* const to =
        coefficient.data + std::size_t{part.coefficient + part.first_rank} * kChannelLanes;
    for_each_rows<4>(
        part.last_rank - part.first_rank, [&]<std::size_t kRows>(std::size_t r) REBOUNCE_INLINE {
          for_each_group<V>(x.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
            project_rows<V, kRows, kVectors>(
                basis + r * part.size, part.size, from + v * x.stride, x.stride,
                to + lane_of(v, coefficient.stride) + r * kChannelLanes, coefficient.stride);
          });
        });
  }
}

/// Whether the result is added to the output, added times a scale, or replaces it.
enum class Output : std::uint8_t { kAdd, kAddScaled, kSet };

/// Computes y at kSize positions; at(v, r) points to the coefficient of vector v and rank r. Ranks
/// are divided among kSplit partial sums, so that at least twelve sums are independent.
template <typename V, std::size_t kSize, std::size_t kVectors, Output kOutput, typename Value,
          typename At>
REBOUNCE_INLINE inline void expand_strip(const Value* basis, std::size_t rank, std::size_t size,
                                         const At& at, float* y, std::size_t y_stride,
                                         float scale) {
  constexpr std::size_t kWide = kSize / V::kWidth;
  constexpr std::size_t kSums = kVectors * kWide;
  constexpr std::size_t kSplit = kSums < 12 ? 12 / kSums : 1;
  V sum[kSplit][kVectors][kWide];
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kWide>([&](auto k) REBOUNCE_INLINE {
      sum[0][v][k] =
          kOutput == Output::kAdd ? V::load(y + v * y_stride + k * V::kWidth) : V::zero();
      unroll<kSplit - 1>([&](auto s) REBOUNCE_INLINE { sum[s + 1][v][k] = V::zero(); });
    });
  });
  const auto add_rank = [&](std::size_t r, auto s) REBOUNCE_INLINE {
    V b[kWide];
    unroll<kWide>([&](auto k)
                      REBOUNCE_INLINE { b[k] = load_ahead<V>(basis + r * size + k * V::kWidth); });
    unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
      const V c = V::broadcast(*at(v, r));
      unroll<kWide>([&](auto k)
                        REBOUNCE_INLINE { sum[s][v][k] = multiply_add(b[k], c, sum[s][v][k]); });
    });
  };
  std::size_t r = 0;
  for (; r + kSplit <= rank; r += kSplit) {
    unroll<kSplit>([&](auto s) REBOUNCE_INLINE { add_rank(r + s, s); });
  }
  for (; r < rank; ++r) add_rank(r, std::integral_constant<std::size_t, 0>{});
  unroll<kVectors>([&](auto v) REBOUNCE_INLINE {
    unroll<kWide>([&](auto k) REBOUNCE_INLINE {
      V total = sum[0][v][k];
      unroll<kSplit - 1>([&](auto s) REBOUNCE_INLINE { total = add(total, sum[s + 1][v][k]); });
      float* const to = y + v * y_stride + k * V::kWidth;
      if constexpr (kOutput == Output::kAddScaled) {
        total = multiply_add(V::broadcast(scale), total, V::load(to));
      }
      total.store(to);
    });
  });
}

/// Computes y in [k, end); `size`: values in a row of the basis.
template <typename V, std::size_t kVectors, Output kOutput, typename Value, typename At>
REBOUNCE_INLINE inline void expand_strips(const Value* basis, std::size_t rank, std::size_t size,
                                          const At& at, std::size_t k, std::size_t end, float* y,
                                          std::size_t y_stride, float scale = 1) {
  const auto add_strips = [&]<std::size_t kSize>() REBOUNCE_INLINE {
    for (; k + kSize <= end; k += kSize) {
      expand_strip<V, kSize, kVectors, kOutput>(basis + k, rank, size, at, y + k, y_stride, scale);
    }
  };
  if constexpr (V::kStrip >= 64) add_strips.template operator()<64>();
  if constexpr (V::kStrip >= 32) add_strips.template operator()<32>();
  add_strips.template operator()<16>();
}

template <typename V, typename Value>
void expand(const Value* values, std::span<const BasisPart> parts,
            Coefficients<const float> coefficient, PlanarVectors<float> y) {
  for (const BasisPart& part : parts) {
    const Value* const basis = values + part.values + std::size_t{part.first_rank} * part.size;
    const float* const from =
        coefficient.data + std::size_t{part.coefficient + part.first_rank} * kChannelLanes;
    for_each_group<V>(y.count, [&]<std::size_t kVectors>(std::size_t v) REBOUNCE_INLINE {
      const float* const c = from + lane_of(v, coefficient.stride);
      const auto at = [&](std::size_t w, std::size_t r) REBOUNCE_INLINE {
        return c + lane_of(w, coefficient.stride) + r * kChannelLanes;
      };
      expand_strips<V, kVectors, Output::kAdd>(basis, part.last_rank - part.first_rank, part.size,
                                               at, part.first_offset, part.last_offset,
                                               y.data + v * y.stride + part.position, y.stride);
    });
  }
}

}  // namespace
}  // namespace rebounce
