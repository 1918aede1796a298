#pragma once

// The vector type of the integer kernels for AVX-512 with VNNI; see integer_kernels_impl.h.

#include <immintrin.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "transfer/kernels/integer_kernels_impl.h"
#include "transfer/kernels/integers_x86.h"

namespace rebounce {
namespace {

struct Shorts32 {
  static constexpr std::size_t kWidth = 32;
  static constexpr std::size_t kStrip = 64;
  /// A product takes four cycles until the next can use its sum.
  static constexpr std::size_t kLeastSums = 12;
  __m512i v;

  static Shorts32 zero() { return {_mm512_setzero_si512()}; }
  static Shorts32 load(const std::int16_t* p) {
    __m512i loaded = _mm512_loadu_si512(p);
    asm("" : "+v"(loaded));  // otherwise g++ 12 loads the value again for each product
    return {loaded};
  }
  static Shorts32 load(const std::int8_t* p) {
    __m512i loaded = _mm512_cvtepi8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
    asm("" : "+v"(loaded));
    return {loaded};
  }
  static Shorts32 repeat_four(const std::int16_t* p) {
    return {_mm512_broadcastq_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)))};
  }
  /// Shuffles (4 ranks)(2 positions) to (2 positions)(4 ranks).
  Shorts32 by_position() const {
    const __m512i order =
        _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 4, 5, 8, 9, 12, 13, 2, 3, 6, 7, 10, 11, 14, 15));
    return {_mm512_shuffle_epi8(v, order)};
  }
  friend Shorts32 add_products(Shorts32 sum, Shorts32 a, Shorts32 b) {
    // With the intrinsic, g++ 12 emits two more moves for each product.
    asm("vpdpwssd %2, %1, %0" : "+v"(sum.v) : "v"(a.v), "v"(b.v));
    return sum;
  }
  friend Shorts32 add(Shorts32 a, Shorts32 b) { return {_mm512_add_epi32(a.v, b.v)}; }

  /// Magnitudes of three planes of `count` floats.
  static Magnitudes magnitudes_of_planes(const float* x, std::size_t stride, std::size_t count) {
    Running r, g, b;
    for (std::size_t k = 0; k < count; k += 16) {
      r.add(_mm512_loadu_ps(x + k));
      g.add(_mm512_loadu_ps(x + k + stride));
      b.add(_mm512_loadu_ps(x + k + 2 * stride));
    }
    return rebounce::magnitudes_of_planes(r.fours(), g.fours(), b.fours());
  }
  /// Magnitudes of each channel among `count` floats of coefficients.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    Running running;
    std::size_t k = 0;
    for (; k + 16 <= count; k += 16) running.add(_mm512_loadu_ps(x + k));
    const auto rest = static_cast<__mmask16>((1U << (count - k)) - 1);
    running.add(_mm512_maskz_loadu_ps(rest, x + k));
    return running.fours().magnitudes();
  }

  static void round_positions(const float* x, float scale, std::int16_t* to) {
    const __m256i rounded = _mm512_cvtsepi32_epi16(
        _mm512_cvtps_epi32(_mm512_mul_ps(_mm512_loadu_ps(x), _mm512_set1_ps(scale))));
    const __m512i pairs = _mm512_castsi256_si512(rounded);
    const __m512i low = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    const __m512i high = _mm512_setr_epi32(4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7);
    _mm512_storeu_si512(to, _mm512_permutexvar_epi32(low, pairs));
    _mm512_storeu_si512(to + kWidth, _mm512_permutexvar_epi32(high, pairs));
  }

  template <std::size_t kGroups>
  REBOUNCE_INLINE static void store_coefficients(const Shorts32 (&red)[kGroups],
                                                 const Shorts32 (&green)[kGroups],
                                                 const Shorts32 (&blue)[kGroups],
                                                 const ChannelFloats& back, bool add_to,
                                                 float* to) {
    const __m512 r = scaled(sums_of_fours(red), back[0]);
    const __m512 g = scaled(sums_of_fours(green), back[1]);
    const __m512 b = scaled(sums_of_fours(blue), back[2]);
    unroll<kGroups>([&](auto k) REBOUNCE_INLINE {
      // Lanes (rank)(channel): red and green from two registers, then blue from a third.
      const __m512i rank = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
      const __m512i lane = _mm512_add_epi32(rank, _mm512_set1_epi32(4 * k));
      const __m512 rg = _mm512_mask_permutexvar_ps(_mm512_permutexvar_ps(lane, r), 0x2222, lane, g);
      __m512 rgb = _mm512_mask_permutexvar_ps(rg, 0xCCCC, lane, b);
      if (add_to) rgb = _mm512_add_ps(_mm512_loadu_ps(to + 16 * k), rgb);
      _mm512_storeu_ps(to + 16 * k, rgb);
    });
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank).
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales)
        : scale(_mm512_broadcast_f32x4(_mm_loadu_ps(scales.data()))) {}
    void operator()(const float* from, std::int16_t* to) const { round(_mm512_loadu_ps(from), to); }
    /// Rounds only the wanted ranks; the others become zero.
    void some(const float* from, RankRange wanted, std::int16_t* to) const {
      const unsigned below = 1U << (4 * wanted.begin), up_to = 1U << (4 * wanted.end);
      round(_mm512_maskz_loadu_ps(static_cast<__mmask16>(up_to - below), from), to);
    }
    void round(__m512 coefficients, std::int16_t* to) const {
      const __m256i rounded =
          _mm512_cvtsepi32_epi16(_mm512_cvtps_epi32(_mm512_mul_ps(coefficients, scale)));
      const __m256i order = _mm256_setr_epi16(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutexvar_epi16(order, rounded));
    }
    __m512 scale;
  };

  /// y[k] += `back` times the sums of neighbouring lanes.
  template <std::size_t kWide>
  REBOUNCE_INLINE static void add_positions(const Shorts32 (&sum)[kWide], float back, float* y) {
    unroll<kWide / 2>([&](auto w) REBOUNCE_INLINE {
      const __m512i even =
          _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
      const __m512i odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
      const __m512i a = sum[2 * w].v, b = sum[2 * w + 1].v;
      const __m512i total = _mm512_add_epi32(_mm512_permutex2var_epi32(a, even, b),
                                             _mm512_permutex2var_epi32(a, odd, b));
      const __m512 light = _mm512_mul_ps(_mm512_cvtepi32_ps(total), _mm512_set1_ps(back));
      _mm512_storeu_ps(y + 16 * w, _mm512_add_ps(_mm512_loadu_ps(y + 16 * w), light));
    });
  }

 private:
  /// Magnitudes by lane. All instruction sets add in this order.
  struct Running {
    __m512 largest = _mm512_setzero_ps(), sum = largest;

    void add(__m512 x) {
      x = _mm512_abs_ps(x);
      largest = _mm512_max_ps(largest, x);
      sum = _mm512_add_ps(sum, x);
    }
    FourMagnitudes fours() const {
      const auto half = [](__m512 v) {
        return _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(v), 1));
      };
      return {_mm256_max_ps(_mm512_castps512_ps256(largest), half(largest)),
              _mm256_add_ps(_mm512_castps512_ps256(sum), half(sum))};
    }
  };
  static __m512 scaled(__m512i sums, float back) {
    return _mm512_mul_ps(_mm512_cvtepi32_ps(sums), _mm512_set1_ps(back));
  }
  /// The sums over the 128-bit lanes of up to four vectors, one vector after the other.
  template <std::size_t kGroups>
  REBOUNCE_INLINE static __m512i sums_of_fours(const Shorts32 (&sum)[kGroups]) {
    __m512i v[4];
    unroll<4>([&](auto k) REBOUNCE_INLINE { v[k] = k < kGroups ? sum[k % kGroups].v : zero().v; });
    const auto halves = [](__m512i a, __m512i b) REBOUNCE_INLINE {
      return _mm512_add_epi32(_mm512_shuffle_i32x4(a, b, 0x88), _mm512_shuffle_i32x4(a, b, 0xDD));
    };
    return halves(halves(v[0], v[1]), halves(v[2], v[3]));
  }
};

}  // namespace
}  // namespace rebounce
