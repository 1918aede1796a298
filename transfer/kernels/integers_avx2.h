#pragma once

// The vector type of the integer kernels for AVX2; see integer_kernels_impl.h.

#include <immintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "transfer/kernels/integer_kernels_impl.h"
#include "transfer/kernels/integers_x86.h"

namespace rebounce {
namespace {

struct Shorts16 {
  static constexpr std::size_t kWidth = 16;
  static constexpr std::size_t kStrip = 8;
  static constexpr std::size_t kLeastSums = 1;  ///< an addition takes one cycle
  __m256i v;

  static Shorts16 zero() { return {_mm256_setzero_si256()}; }
  static Shorts16 load(const std::int16_t* p) {
    return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p))};
  }
  static Shorts16 load(const std::int8_t* p) {
    return {_mm256_cvtepi8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)))};
  }
  static Shorts16 repeat_four(const std::int16_t* p) {
    return {_mm256_broadcastq_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)))};
  }
  /// Shuffles (4 ranks)(2 positions) to (2 positions)(4 ranks).
  Shorts16 by_position() const {
    const __m256i order = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 1, 4, 5, 8, 9, 12, 13, 2, 3, 6, 7, 10, 11, 14, 15));
    return {_mm256_shuffle_epi8(v, order)};
  }
  friend Shorts16 add_products(Shorts16 sum, Shorts16 a, Shorts16 b) {
    return {_mm256_add_epi32(sum.v, _mm256_madd_epi16(a.v, b.v))};
  }
  friend Shorts16 add(Shorts16 a, Shorts16 b) { return {_mm256_add_epi32(a.v, b.v)}; }

  /// Magnitudes of three planes of `count` floats.
  static Magnitudes magnitudes_of_planes(const float* x, std::size_t stride, std::size_t count) {
    Running r, g, b;
    for (std::size_t k = 0; k < count; k += 16) {
      r.add(_mm256_loadu_ps(x + k), _mm256_loadu_ps(x + k + 8));
      g.add(_mm256_loadu_ps(x + k + stride), _mm256_loadu_ps(x + k + stride + 8));
      b.add(_mm256_loadu_ps(x + k + 2 * stride), _mm256_loadu_ps(x + k + 2 * stride + 8));
    }
    return rebounce::magnitudes_of_planes(r.fours(), g.fours(), b.fours());
  }
  /// Magnitudes of each channel among `count` floats of coefficients.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    Running running;
    for (; count >= 16; count -= 16, x += 16)
      running.add(_mm256_loadu_ps(x), _mm256_loadu_ps(x + 8));
    running.add(load_some(x, std::min<std::size_t>(count, 8)),
                load_some(x + 8, count < 8 ? 0 : count - 8));
    return running.fours().magnitudes();
  }

  static void round_positions(const float* x, float scale, std::int16_t* to) {
    const __m256 by = _mm256_set1_ps(scale);
    // Positions 0 to 3, 8 to 11, 4 to 7, 12 to 15.
    const __m256i pairs =
        _mm256_packs_epi32(wide(_mm256_loadu_ps(x), by), wide(_mm256_loadu_ps(x + 8), by));
    store_lanes(to, _mm256_permutevar8x32_epi32(pairs, lane_order(0, 1)));
    store_lanes(to + kWidth, _mm256_permutevar8x32_epi32(pairs, lane_order(4, 5)));
    store_lanes(to + 2 * kWidth, _mm256_permutevar8x32_epi32(pairs, lane_order(2, 3)));
    store_lanes(to + 3 * kWidth, _mm256_permutevar8x32_epi32(pairs, lane_order(6, 7)));
  }

  template <std::size_t kGroups>
  REBOUNCE_INLINE static void store_coefficients(const Shorts16 (&red)[kGroups],
                                                 const Shorts16 (&green)[kGroups],
                                                 const Shorts16 (&blue)[kGroups],
                                                 const ChannelFloats& back, bool add_to,
                                                 float* to) {
    unroll<kGroups>([&](auto k) REBOUNCE_INLINE {
      __m128 r = scaled(red[k], back[0]), g = scaled(green[k], back[1]);
      __m128 b = scaled(blue[k], back[2]), unused = b;
      _MM_TRANSPOSE4_PS(r, g, b, unused);
      const __m128 rank[kRankGroup] = {r, g, b, unused};
      for (std::size_t i = 0; i < kRankGroup; ++i) {
        float* const at = to + 16 * k + 4 * i;
        _mm_storeu_ps(at, add_to ? _mm_add_ps(_mm_loadu_ps(at), rank[i]) : rank[i]);
      }
    });
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank).
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales)
        : scale(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(scales.data()))) {}
    void operator()(const float* from, std::int16_t* to) const {
      round(_mm256_loadu_ps(from), _mm256_loadu_ps(from + 8), to);
    }
    /// Rounds only the wanted ranks; the others become zero.
    void some(const float* from, RankRange wanted, std::int16_t* to) const {
      const __m256i rank = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
      const auto load = [&](int first) {
        const __m256i r = _mm256_add_epi32(rank, _mm256_set1_epi32(first));
        const __m256i keep = _mm256_andnot_si256(
            _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(wanted.begin)), r),
            _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(wanted.end)), r));
        return _mm256_maskload_ps(from + 4 * first, keep);
      };
      round(load(0), load(2), to);
    }
    void round(__m256 first, __m256 second, std::int16_t* to) const {
      const __m256i ranks = _mm256_packs_epi32(wide(first, scale), wide(second, scale));
      const __m128i even = _mm256_castsi256_si128(ranks), odd = _mm256_extracti128_si256(ranks, 1);
      const __m128i low = _mm_unpacklo_epi16(even, odd), high = _mm_unpackhi_epi16(even, odd);
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm_unpacklo_epi32(low, high));
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 8), _mm_unpackhi_epi32(low, high));
    }
    __m256 scale;
  };

  /// y[k] += `back` times the sums of neighbouring lanes.
  template <std::size_t kWide>
  REBOUNCE_INLINE static void add_positions(const Shorts16 (&sum)[kWide], float back, float* y) {
    unroll<kWide / 2>([&](auto w) REBOUNCE_INLINE {
      const __m256i total =
          _mm256_permute4x64_epi64(_mm256_hadd_epi32(sum[2 * w].v, sum[2 * w + 1].v), 0xD8);
      const __m256 light = _mm256_mul_ps(_mm256_cvtepi32_ps(total), _mm256_set1_ps(back));
      _mm256_storeu_ps(y + 8 * w, _mm256_add_ps(_mm256_loadu_ps(y + 8 * w), light));
    });
  }

 private:
  static void store_lanes(std::int16_t* to, __m256i lanes) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), lanes);
  }
  /// Magnitudes by lane, for sixteen floats at a time. All instruction sets add in this order.
  struct Running {
    __m256 largest = _mm256_setzero_ps(), first_sum = largest, second_sum = largest;

    void add(__m256 first, __m256 second) {
      first = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), first);
      second = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), second);
      largest = _mm256_max_ps(largest, _mm256_max_ps(first, second));
      first_sum = _mm256_add_ps(first_sum, first);
      second_sum = _mm256_add_ps(second_sum, second);
    }
    FourMagnitudes fours() const { return {largest, _mm256_add_ps(first_sum, second_sum)}; }
  };
  static __m256 load_some(const float* x, std::size_t count) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    return _mm256_maskload_ps(x,
                              _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane));
  }
  static __m256i wide(__m256 x, __m256 scale) {
    return _mm256_cvtps_epi32(_mm256_mul_ps(x, scale));
  }
  /// Four times lane a, then four times lane b.
  static __m256i lane_order(int a, int b) { return _mm256_setr_epi32(a, a, a, a, b, b, b, b); }
  static __m128 scaled(Shorts16 sum, float back) {
    const __m128i four =
        _mm_add_epi32(_mm256_castsi256_si128(sum.v), _mm256_extracti128_si256(sum.v, 1));
    return _mm_mul_ps(_mm_cvtepi32_ps(four), _mm_set1_ps(back));
  }
};

}  // namespace
}  // namespace rebounce
