#pragma once

// The vector type of the integer kernels for AVX2; see integer_kernels_impl.h.

#include <immintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "transfer/kernels/integer_kernels_impl.h"
#include "transfer/kernels/integers_x86.h"

namespace rebounce {
namespace {

struct Integers256 {
  /// Eight sums.
  struct Sum {
    __m256i v;
  };
  static constexpr std::size_t kStrip = 16;
  static constexpr std::size_t kLeastSums = 1;  ///< an addition takes one cycle

  static Sum zero() { return {_mm256_setzero_si256()}; }
  static Sum add(Sum a, Sum b) { return {_mm256_add_epi32(a.v, b.v)}; }

  // Projection in 16-bit integers: sums are (4 ranks)(2 pairs of positions).

  static constexpr std::size_t kProjectedGroups = 4;
  static constexpr std::size_t kProjected = 4;
  static constexpr std::size_t kLightBytes = 2;  ///< of a position
  struct Ranks {
    __m256i v;
  };
  struct Light {
    __m256i v;
  };
  static Ranks load_ranks(const std::int8_t* p) {
    return {_mm256_cvtepi8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)))};
  }
  static Light load_light(const std::uint8_t* words, std::size_t position) {
    return {_mm256_broadcastq_epi64(
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(words + position * kLightBytes)))};
  }
  using ProjectedSum = Sum;
  template <bool kSigned>
  static Sum first_sum(std::int32_t /*light_sum*/) {
    return zero();
  }
  template <bool kSigned>
  static Sum add_projected(Sum sum, Ranks basis, Light light) {
    return {_mm256_add_epi32(sum.v, _mm256_madd_epi16(basis.v, light.v))};
  }

  /// Rounds one word of the light of sixteen positions.
  class Rounding {
   public:
    Rounding(float scale, int below, bool is_signed)
        : scale_(_mm256_set1_ps(scale)),
          below_(_mm_cvtsi32_si128(below)),
          kept_(_mm256_set1_epi32(is_signed ? -1 : (1 << kWordBits) - 1)) {}
    std::int32_t operator()(const float* x, std::uint8_t* to) const {
      const __m256i words =
          _mm256_packs_epi32(word_of(_mm256_loadu_ps(x)), word_of(_mm256_loadu_ps(x + 8)));
      // Positions 0 to 3, 8 to 11, 4 to 7, 12 to 15.
      constexpr int kInOrder = 0xD8;
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                          _mm256_permute4x64_epi64(words, kInOrder));
      return 0;
    }

   private:
    __m256i word_of(__m256 x) const {
      const __m256i all = _mm256_cvtps_epi32(_mm256_mul_ps(x, scale_));
      return _mm256_and_si256(_mm256_sra_epi32(all, below_), kept_);
    }
    __m256 scale_;
    __m128i below_;
    __m256i kept_;
  };

  /// Measures a run. All instruction sets add in this order.
  static void measure_run(const float* x, std::size_t stride, LightRun& run) {
    const __m256 sign = _mm256_set1_ps(-0.0F), zero = _mm256_setzero_ps();
    __m128 largest[kChannelLanes], sum[kChannelLanes];
    __m256 least = zero;
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const __m256 first = _mm256_loadu_ps(x + c * stride);
      const __m256 second = _mm256_loadu_ps(x + c * stride + 8);
      const __m256 a = _mm256_andnot_ps(sign, first), b = _mm256_andnot_ps(sign, second);
      largest[c] = largest_of_halves(_mm256_max_ps(a, b));
      sum[c] = sum_of_halves(_mm256_add_ps(a, b));
      least = _mm256_min_ps(least, _mm256_min_ps(first, second));
    }
    largest[kChannelCount] = largest_of_halves(_mm256_sub_ps(zero, least));
    sum[kChannelCount] = _mm_setzero_ps();
    _MM_TRANSPOSE4_PS(largest[0], largest[1], largest[2], largest[3]);
    _MM_TRANSPOSE4_PS(sum[0], sum[1], sum[2], sum[3]);
    _mm_storeu_ps(run.largest.data(), _mm_max_ps(_mm_max_ps(largest[0], largest[2]),
                                                 _mm_max_ps(largest[1], largest[3])));
    _mm_storeu_ps(run.sum.data(),
                  _mm_add_ps(_mm_add_ps(sum[0], sum[2]), _mm_add_ps(sum[1], sum[3])));
  }

  template <std::size_t kGroups>
  REBOUNCE_INLINE static void store_coefficients(const Sum (&red)[kGroups],
                                                 const Sum (&green)[kGroups],
                                                 const Sum (&blue)[kGroups],
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

  // Expansion: sums are of eight positions.

  static constexpr std::size_t kExpanded = 8;
  struct Positions {
    __m256i even, odd;  ///< words of ranks 0 and 2, of ranks 1 and 3
  };
  struct Pair {
    __m256i v;
  };
  static Positions load_positions(const std::int8_t* p) {
    const __m256i order = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15));
    const __m256i ranks =
        _mm256_shuffle_epi8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)), order);
    return {_mm256_srai_epi16(_mm256_slli_epi16(ranks, 8), 8), _mm256_srai_epi16(ranks, 8)};
  }
  static Pair broadcast_pair(const std::int16_t* p) {
    std::int32_t pair = 0;
    std::memcpy(&pair, p, sizeof pair);
    return {_mm256_set1_epi32(pair)};
  }
  static Sum add_products(Sum sum, __m256i words, Pair coefficients) {
    return {_mm256_add_epi32(sum.v, _mm256_madd_epi16(words, coefficients.v))};
  }

  /// Magnitudes of each channel among `count` floats of coefficients.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    Running running;
    for (; count >= 32; count -= 32, x += 32) {
      running.add(_mm256_loadu_ps(x), _mm256_loadu_ps(x + 8), _mm256_loadu_ps(x + 16),
                  _mm256_loadu_ps(x + 24));
    }
    const auto rest = [&](std::size_t first) {
      return load_some(x + first, count < first ? 0 : std::min<std::size_t>(count - first, 8));
    };
    running.add(rest(0), rest(8), rest(16), rest(24));
    return running.fours().magnitudes();
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank), even ranks first.
  /// Returns whether any is above zero in magnitude.
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales)
        : scale(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(scales.data()))) {}
    bool operator()(const float* from, std::int16_t* to) const { return some(from, {0, 4}, to); }
    /// Rounds only the wanted ranks; the others become zero.
    bool some(const float* from, RankRange wanted, std::int16_t* to) const {
      // The fourth lane of a rank is unused: it belongs to no rank that is wanted.
      constexpr int kNone = -1;
      const __m256i rank = _mm256_setr_epi32(0, 0, 0, kNone, 1, 1, 1, kNone);
      const auto load = [&](int first) {
        const __m256i r = _mm256_or_si256(rank, _mm256_set1_epi32(first));
        const __m256i keep = _mm256_andnot_si256(
            _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(wanted.begin)), r),
            _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(wanted.end)), r));
        return _mm256_maskload_ps(from + 4 * first, keep);
      };
      return round(load(0), load(2), to);
    }
    bool round(__m256 first, __m256 second, std::int16_t* to) const {
      // Ranks 0, 2, 1, 3 in each 64 bits of the first and the second half.
      const __m256i ranks = _mm256_packs_epi32(wide(first, scale), wide(second, scale));
      const __m128i even = _mm256_castsi256_si128(ranks), odd = _mm256_extracti128_si256(ranks, 1);
      const __m128i zero_two = _mm_unpacklo_epi16(even, _mm_srli_si128(even, 8));
      const __m128i one_three = _mm_unpacklo_epi16(odd, _mm_srli_si128(odd, 8));
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm_unpacklo_epi32(zero_two, one_three));
      _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 8), _mm_unpackhi_epi32(zero_two, one_three));
      return _mm256_testz_si256(ranks, ranks) == 0;
    }
    __m256 scale;
  };

  /// y[k] += `back` times the sum of position k.
  static void add_to_light(Sum sum, float back, float* y) {
    const __m256 light = _mm256_mul_ps(_mm256_cvtepi32_ps(sum.v), _mm256_set1_ps(back));
    _mm256_storeu_ps(y, _mm256_add_ps(_mm256_loadu_ps(y), light));
  }

 private:
  /// Magnitudes by lane, for 32 floats at a time. All instruction sets add in this order.
  struct Running {
    __m256 largest = _mm256_setzero_ps(), sum[4] = {largest, largest, largest, largest};

    void add(__m256 a, __m256 b, __m256 c, __m256 d) {
      __m256 eight[] = {a, b, c, d};
      for (int k = 0; k < 4; ++k) {
        eight[k] = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), eight[k]);
        largest = _mm256_max_ps(largest, eight[k]);
        sum[k] = _mm256_add_ps(sum[k], eight[k]);
      }
    }
    FourMagnitudes fours() const {
      return {largest, _mm256_add_ps(_mm256_add_ps(sum[0], sum[2]), _mm256_add_ps(sum[1], sum[3]))};
    }
  };
  static __m256 load_some(const float* x, std::size_t count) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    return _mm256_maskload_ps(x,
                              _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane));
  }
  static __m256i wide(__m256 x, __m256 scale) {
    return _mm256_cvtps_epi32(_mm256_mul_ps(x, scale));
  }
  static __m128 scaled(Sum sum, float back) {
    const __m128i four =
        _mm_hadd_epi32(_mm256_castsi256_si128(sum.v), _mm256_extracti128_si256(sum.v, 1));
    return _mm_mul_ps(_mm_cvtepi32_ps(four), _mm_set1_ps(back));
  }
};

}  // namespace
}  // namespace rebounce
