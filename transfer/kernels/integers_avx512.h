#pragma once

// The vector type of the integer kernels for AVX-512 with VNNI; see integer_kernels_impl.h.

#include <immintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "transfer/kernels/integer_kernels_impl.h"
#include "transfer/kernels/integers_x86.h"

namespace rebounce {
namespace {

struct Integers512 {
  /// Sixteen sums.
  struct Sum {
    __m512i v;
  };
  static constexpr std::size_t kStrip = 64;
  /// A product takes four cycles until the next can use its sum.
  static constexpr std::size_t kLeastSums = 12;

  static Sum zero() { return {_mm512_setzero_si512()}; }
  static Sum add(Sum a, Sum b) { return {_mm512_add_epi32(a.v, b.v)}; }

  // Projection: sums are (4 groups of positions)(4 ranks), of the higher bytes of the light and of
  // the lower ones.

  static constexpr std::size_t kProjectedGroups = 4;
  static constexpr std::size_t kProjected = 16;
  /// Of a position: each four positions' higher bytes are there four times, then the lower ones.
  static constexpr std::size_t kLightBytes = 2 * kRankGroup;
  struct Ranks {
    __m512i v;
  };
  struct Light {
    __m512i high, low;
  };
  struct ProjectedSum {
    __m512i high, low;
  };
  static Ranks load_ranks(const std::int8_t* p) { return {load(p)}; }
  static Light load_light(const std::uint8_t* words, std::size_t position) {
    const std::uint8_t* const at = words + position * kLightBytes;
    return {load(at), load(at + 64)};
  }
  /// Products have one unsigned factor. Where light is signed, that of its higher bytes is the
  /// basis plus 128, and sums begin at what this adds.
  template <bool kSigned>
  static ProjectedSum first_sum(std::int32_t light_sum) {
    const __m512i zeros = _mm512_setzero_si512();
    if constexpr (!kSigned) return {zeros, zeros};
    return {_mm512_zextsi128_si512(_mm_set1_epi32(-128 * light_sum)), zeros};
  }
  template <bool kSigned>
  static ProjectedSum add_projected(ProjectedSum sum, Ranks basis, Light light) {
    // With the intrinsic, g++ 12 emits two more moves for each product.
    if constexpr (kSigned) {
      const __m512i raised = _mm512_xor_si512(basis.v, _mm512_set1_epi8(-128));
      asm("vpdpbusd %2, %1, %0" : "+v"(sum.high) : "v"(raised), "v"(light.high));
    } else {
      asm("vpdpbusd %2, %1, %0" : "+v"(sum.high) : "v"(light.high), "v"(basis.v));
    }
    asm("vpdpbusd %2, %1, %0" : "+v"(sum.low) : "v"(light.low), "v"(basis.v));
    return sum;
  }

  /// Rounds one word of the light of sixteen positions.
  class Rounding {
   public:
    Rounding(float scale, int below, bool is_signed)
        : scale_(_mm512_set1_ps(scale)),
          below_(_mm_cvtsi32_si128(below)),
          kept_(_mm512_set1_epi32(is_signed ? -1 : (1 << kWordBits) - 1)),
          is_signed_(is_signed) {}
    /// Returns the sum of the highest bytes of signed words.
    std::int32_t operator()(const float* x, std::uint8_t* to) const {
      const __m512i all = _mm512_cvtps_epi32(_mm512_mul_ps(_mm512_loadu_ps(x), scale_));
      const __m512i words = _mm512_and_si512(_mm512_sra_epi32(all, below_), kept_);
      _mm512_storeu_si512(to, _mm512_shuffle_epi8(words, _mm512_set1_epi32(0x0D090501)));
      _mm512_storeu_si512(to + 64, _mm512_shuffle_epi8(words, _mm512_set1_epi32(0x0C080400)));
      return is_signed_ ? _mm512_reduce_add_epi32(_mm512_srai_epi32(words, 8)) : 0;
    }

   private:
    __m512 scale_;
    __m128i below_;
    __m512i kept_;
    bool is_signed_;
  };

  /// Measures a run. All instruction sets add in this order.
  static void measure_run(const float* x, std::size_t stride, LightRun& run) {
    __m512 magnitude[kChannelCount], darkness = _mm512_setzero_ps();
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const __m512 light = _mm512_loadu_ps(x + c * stride);
      magnitude[c] = _mm512_abs_ps(light);
      darkness = _mm512_max_ps(darkness, _mm512_sub_ps(_mm512_setzero_ps(), light));
    }
    const auto largest = [](__m512 a, __m512 b) REBOUNCE_INLINE { return _mm512_max_ps(a, b); };
    const auto sum = [](__m512 a, __m512 b) REBOUNCE_INLINE { return _mm512_add_ps(a, b); };
    _mm_storeu_ps(run.largest.data(),
                  over_lanes(magnitude[0], magnitude[1], magnitude[2], darkness, largest));
    _mm_storeu_ps(run.sum.data(),
                  over_lanes(magnitude[0], magnitude[1], magnitude[2], _mm512_setzero_ps(), sum));
  }

  template <std::size_t kGroups>
  REBOUNCE_INLINE static void store_coefficients(const ProjectedSum (&red)[kGroups],
                                                 const ProjectedSum (&green)[kGroups],
                                                 const ProjectedSum (&blue)[kGroups],
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

  // Expansion: sums are of sixteen positions.

  static constexpr std::size_t kExpanded = 16;
  struct Positions {
    __m512i even, odd;  ///< words of ranks 0 and 2, of ranks 1 and 3
  };
  struct Pair {
    __m512i v;
  };
  static Positions load_positions(const std::int8_t* p) {
    const __m512i order =
        _mm512_broadcast_i32x4(_mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15));
    const __m512i ranks = _mm512_shuffle_epi8(load(p), order);
    return {_mm512_srai_epi16(_mm512_slli_epi16(ranks, 8), 8), _mm512_srai_epi16(ranks, 8)};
  }
  static Pair broadcast_pair(const std::int16_t* p) {
    std::int32_t pair = 0;
    std::memcpy(&pair, p, sizeof pair);
    return {_mm512_set1_epi32(pair)};
  }
  static Sum add_products(Sum sum, __m512i words, Pair coefficients) {
    asm("vpdpwssd %2, %1, %0" : "+v"(sum.v) : "v"(words), "v"(coefficients.v));
    return sum;
  }

  /// Magnitudes of each channel among `count` floats of coefficients.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    Running running;
    for (; count >= 32; count -= 32, x += 32)
      running.add(_mm512_loadu_ps(x), _mm512_loadu_ps(x + 16));
    running.add(load_some(x, std::min<std::size_t>(count, 16)),
                load_some(x + 16, count < 16 ? 0 : count - 16));
    return running.fours().magnitudes();
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank), even ranks first.
  /// Returns whether any is above zero in magnitude.
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales)
        : scale(_mm512_broadcast_f32x4(_mm_loadu_ps(scales.data()))) {}
    bool operator()(const float* from, std::int16_t* to) const {
      return round(_mm512_maskz_loadu_ps(kUsedLanes, from), to);
    }
    /// Rounds only the wanted ranks; the others become zero.
    bool some(const float* from, RankRange wanted, std::int16_t* to) const {
      const unsigned below = 1U << (4 * wanted.begin), up_to = 1U << (4 * wanted.end);
      return round(
          _mm512_maskz_loadu_ps(static_cast<__mmask16>((up_to - below) & kUsedLanes), from), to);
    }
    bool round(__m512 coefficients, std::int16_t* to) const {
      constexpr int kLargest = 0x7FFF;
      const __m512i wide = _mm512_min_epi32(_mm512_cvtps_epi32(_mm512_mul_ps(coefficients, scale)),
                                            _mm512_set1_epi32(kLargest));
      // Of each sum the lower word.
      const __m512i order = _mm512_cvtepu8_epi16(
          _mm256_setr_epi8(0, 16, 8, 24, 2, 18, 10, 26, 4, 20, 12, 28, 6, 22, 14, 30, 0, 0, 0, 0, 0,
                           0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
      const __m256i rounded = _mm512_castsi512_si256(_mm512_permutexvar_epi16(order, wide));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), rounded);
      return _mm256_testz_si256(rounded, rounded) == 0;
    }
    static constexpr unsigned kUsedLanes = 0x7777;  ///< the fourth lane is unused
    __m512 scale;
  };

  /// y[k] += `back` times the sum of position k.
  static void add_to_light(Sum sum, float back, float* y) {
    const __m512 light = _mm512_mul_ps(_mm512_cvtepi32_ps(sum.v), _mm512_set1_ps(back));
    _mm512_storeu_ps(y, _mm512_add_ps(_mm512_loadu_ps(y), light));
  }

 private:
  static __m512i load(const void* p) {
    __m512i loaded = _mm512_loadu_si512(p);
    asm("" : "+v"(loaded));  // otherwise g++ 12 loads the value again for each product
    return loaded;
  }
  static __m256 upper_half(__m512 v) {
    return _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(v), 1));
  }
  /// Combines the lanes of each vector.
  template <typename Combine>
  REBOUNCE_INLINE static __m128 over_lanes(__m512 a, __m512 b, __m512 c, __m512 d,
                                           const Combine& combine) {
    const auto halves = [&](__m512 v, __m512 w) REBOUNCE_INLINE {
      return combine(_mm512_shuffle_f32x4(v, w, 0x44), _mm512_shuffle_f32x4(v, w, 0xEE));
    };
    const __m512 ab = halves(a, b), cd = halves(c, d);
    __m512 all = combine(_mm512_shuffle_f32x4(ab, cd, 0x88), _mm512_shuffle_f32x4(ab, cd, 0xDD));
    all = combine(all, _mm512_permute_ps(all, 0x4E));
    all = combine(all, _mm512_permute_ps(all, 0xB1));
    const __m512i fourth = _mm512_setr_epi32(0, 4, 8, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    return _mm512_castps512_ps128(_mm512_permutexvar_ps(fourth, all));
  }
  /// Magnitudes by lane, for 32 floats at a time. All instruction sets add in this order.
  struct Running {
    __m512 largest = _mm512_setzero_ps(), sum[2] = {largest, largest};

    void add(__m512 first, __m512 second) {
      first = _mm512_abs_ps(first);
      second = _mm512_abs_ps(second);
      largest = _mm512_max_ps(largest, _mm512_max_ps(first, second));
      sum[0] = _mm512_add_ps(sum[0], first);
      sum[1] = _mm512_add_ps(sum[1], second);
    }
    FourMagnitudes fours() const {
      const __m512 all = _mm512_add_ps(sum[0], sum[1]);
      return {_mm256_max_ps(_mm512_castps512_ps256(largest), upper_half(largest)),
              _mm256_add_ps(_mm512_castps512_ps256(all), upper_half(all))};
    }
  };
  static __m512 load_some(const float* x, std::size_t count) {
    return _mm512_maskz_loadu_ps(static_cast<__mmask16>((1U << count) - 1), x);
  }
  static __m512 scaled(__m512i sums, float back) {
    return _mm512_mul_ps(_mm512_cvtepi32_ps(sums), _mm512_set1_ps(back));
  }
  /// The sums over the 128-bit lanes of up to four vectors, one vector after the other.
  template <std::size_t kGroups>
  REBOUNCE_INLINE static __m512i sums_of_fours(const ProjectedSum (&sum)[kGroups]) {
    __m512i v[4];
    unroll<4>([&](auto k) REBOUNCE_INLINE {
      const ProjectedSum& s = sum[k % kGroups];
      v[k] = k < kGroups ? _mm512_add_epi32(_mm512_slli_epi32(s.high, 8), s.low) : zero().v;
    });
    const auto halves = [](__m512i a, __m512i b) REBOUNCE_INLINE {
      return _mm512_add_epi32(_mm512_shuffle_i32x4(a, b, 0x88), _mm512_shuffle_i32x4(a, b, 0xDD));
    };
    return halves(halves(v[0], v[1]), halves(v[2], v[3]));
  }
};

}  // namespace
}  // namespace rebounce
