#pragma once

// The portable vector type of the integer kernels; see integer_kernels_impl.h.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include "transfer/kernels/integer_kernels_impl.h"

namespace rebounce {
namespace {

/// Sixteen bytes, eight words or four sums, with the vector extension of GCC and Clang.
struct Integers128 {
  using Bytes = std::int8_t __attribute__((vector_size(16)));
  using Words = std::int16_t __attribute__((vector_size(16)));
  using Sums = std::int32_t __attribute__((vector_size(16)));
  static constexpr std::size_t kStrip = 8;
  static constexpr std::size_t kLeastSums = 1;

  struct Sum {
    Sums low, high;
  };
  static Sum zero() { return Sum{Sums{}, Sums{}}; }
  static Sum add(const Sum& a, const Sum& b) { return {a.low + b.low, a.high + b.high}; }

  // Projection in 16-bit integers: sums are (4 ranks)(2 pairs of positions).

  static constexpr std::size_t kProjectedGroups = 4;
  static constexpr std::size_t kProjected = 4;
  static constexpr std::size_t kLightBytes = 2;  ///< of a position
  struct Ranks {
    Words low, high;
  };
  struct Light {
    Words v;
  };
  static Ranks load_ranks(const std::int8_t* p) { return {widened(p), widened(p + 8)}; }
  static Light load_light(const std::uint8_t* words, std::size_t position) {
    std::int64_t four = 0;
    std::memcpy(&four, words + position * kLightBytes, sizeof four);
    using Pair = std::int64_t __attribute__((vector_size(16)));
    return {std::bit_cast<Words>(Pair{four, four})};
  }
  using ProjectedSum = Sum;
  template <bool kSigned>
  static Sum first_sum(std::int32_t /*light_sum*/) {
    return zero();
  }
  template <bool kSigned>
  static Sum add_projected(const Sum& sum, const Ranks& basis, const Light& light) {
    return {sum.low + products(basis.low, light.v), sum.high + products(basis.high, light.v)};
  }

  /// Rounds one word of the light of sixteen positions.
  class Rounding {
   public:
    Rounding(float scale, int below, bool is_signed)
        : scale_(scale), below_(below), kept_(is_signed ? -1 : (1 << kWordBits) - 1) {}
    std::int32_t operator()(const float* x, std::uint8_t* to) const {
      std::int16_t words[kRun];
      for (std::size_t k = 0; k < kRun; ++k) {
        words[k] = static_cast<std::int16_t>((rounded(x[k] * scale_) >> below_) & kept_);
      }
      std::memcpy(to, words, sizeof words);
      return 0;
    }

   private:
    float scale_;
    int below_;
    std::int32_t kept_;
  };

  /// Measures a run. All instruction sets add in this order.
  static void measure_run(const float* x, std::size_t stride, LightRun& run) {
    run = {};
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const float* const light = x + c * stride;
      float sum[kRun];
      for (std::size_t k = 0; k < kRun; ++k) {
        sum[k] = std::abs(light[k]);
        run.largest[c] = std::max(run.largest[c], sum[k]);
        run.largest[kChannelCount] = std::max(run.largest[kChannelCount], -light[k]);
      }
      for (std::size_t half = kRun / 2; half > 0; half /= 2) {
        for (std::size_t k = 0; k < half; ++k) sum[k] += sum[k + half];
      }
      run.sum[c] = sum[0];
    }
  }

  template <std::size_t kGroups>
  static void store_coefficients(const Sum (&red)[kGroups], const Sum (&green)[kGroups],
                                 const Sum (&blue)[kGroups], const ChannelFloats& back, bool add_to,
                                 float* to) {
    for (std::size_t k = 0; k < kGroups * kRankGroup; ++k, to += kChannelLanes) {
      const Sum* const sums[] = {&red[k / kRankGroup], &green[k / kRankGroup],
                                 &blue[k / kRankGroup]};
      const std::size_t rank = k % kRankGroup, first = rank % 2 * 2;
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        const Sums& pairs = rank < 2 ? sums[c]->low : sums[c]->high;
        const float light = static_cast<float>(pairs[first] + pairs[first + 1]) * back[c];
        to[c] = add_to ? to[c] + light : light;
      }
    }
  }

  // Expansion: sums are of four positions.

  static constexpr std::size_t kExpanded = 4;
  struct Positions {
    Words even, odd;  ///< words of ranks 0 and 2, of ranks 1 and 3
  };
  struct Pair {
    Words v;
  };
  static Positions load_positions(const std::int8_t* p) {
    Bytes bytes;
    std::memcpy(&bytes, p, sizeof bytes);
    const auto ranks = std::bit_cast<Words>(__builtin_shufflevector(
        bytes, bytes, 0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15));
    return {(ranks << 8) >> 8, ranks >> 8};
  }
  static Pair broadcast_pair(const std::int16_t* p) {
    std::int32_t pair = 0;
    std::memcpy(&pair, p, sizeof pair);
    return {std::bit_cast<Words>(Sums{pair, pair, pair, pair})};
  }
  static Sum add_products(const Sum& sum, const Words& words, const Pair& coefficients) {
    return {sum.low + products(words, coefficients.v), sum.high};
  }

  /// Magnitudes of each channel among `count` floats of coefficients. All instruction sets add in
  /// this order.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    std::array<float, 32> sum{};
    std::array<float, 16> largest{};
    for (std::size_t k = 0; k < count; ++k) {
      largest[k % 16] = std::max(largest[k % 16], std::abs(x[k]));
      sum[k % 32] += std::abs(x[k]);
    }
    for (std::size_t k = 0; k < 16; ++k) sum[k] += sum[k + 16];
    Magnitudes result;
    for (std::size_t c = 0; c < kChannelLanes; ++c) {
      result.largest[c] = std::max({largest[c], largest[c + 4], largest[c + 8], largest[c + 12]});
      result.sum[c] = (sum[c] + sum[c + 8]) + (sum[c + 4] + sum[c + 12]);
    }
    return result;
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank), even ranks first.
  /// Returns whether any is above zero in magnitude.
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales) : scale(scales) {}
    bool operator()(const float* from, std::int16_t* to) const {
      return some(from, {0, kRankGroup}, to);
    }
    /// Rounds only the wanted ranks; the others become zero.
    bool some(const float* from, RankRange wanted, std::int16_t* to) const {
      constexpr std::size_t kPlace[kRankGroup] = {0, 2, 1, 3};
      std::fill_n(to, IntegerCoefficients::kGroupSize, std::int16_t{0});
      bool any = false;
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        for (std::size_t r = wanted.begin; r < wanted.end; ++r) {
          const float x = from[r * kChannelLanes + c] * scale[c];
          const auto integer =
              static_cast<std::int16_t>(rounded(std::clamp(x, -32768.0F, 32767.0F)));
          to[c * kRankGroup + kPlace[r]] = integer;
          any |= integer != 0;
        }
      }
      return any;
    }
    ChannelFloats scale;
  };

  /// y[k] += `back` times the sum of position k.
  static void add_to_light(const Sum& sum, float back, float* y) {
    for (std::size_t k = 0; k < kExpanded; ++k) y[k] += static_cast<float>(sum.low[k]) * back;
  }

 private:
  static Words widened(const std::int8_t* p) {
    using Half = std::int8_t __attribute__((vector_size(8)));
    Half bytes;
    std::memcpy(&bytes, p, sizeof bytes);
    return __builtin_convertvector(bytes, Words);
  }
  /// Sums of the products of neighbouring pairs.
  static Sums products(const Words& a, const Words& b) {
#if defined(__SSE2__)
    return std::bit_cast<Sums>(
        _mm_madd_epi16(std::bit_cast<__m128i>(a), std::bit_cast<__m128i>(b)));
#elif defined(__wasm_simd128__)
    return std::bit_cast<Sums>(
        wasm_i32x4_dot_i16x8(std::bit_cast<v128_t>(a), std::bit_cast<v128_t>(b)));
#else
    const auto x = std::bit_cast<Sums>(a), y = std::bit_cast<Sums>(b);
    const Sums low = ((x << 16) >> 16) * ((y << 16) >> 16);
    return low + (x >> 16) * (y >> 16);
#endif
  }
  /// Rounds to the nearest integer, ties to even.
  static std::int32_t rounded(float x) {
#if defined(__wasm_simd128__)
    return static_cast<std::int32_t>(std::nearbyint(x));  // lrint is a call there
#else
    return static_cast<std::int32_t>(std::lrint(x));
#endif
  }
};

}  // namespace
}  // namespace rebounce
