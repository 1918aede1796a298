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
#endif

#include "transfer/kernels/integer_kernels_impl.h"

namespace rebounce {
namespace {

/// Eight 16-bit integers or four 32-bit sums, with the vector extension of GCC and Clang.
struct Shorts8 {
  using Shorts = std::int16_t __attribute__((vector_size(16)));
  using Sums = std::int32_t __attribute__((vector_size(16)));
  static constexpr std::size_t kWidth = 8;
  static constexpr std::size_t kStrip = 4;
  static constexpr std::size_t kLeastSums = 1;
  Sums v;

  static Shorts8 zero() { return {Sums{}}; }
  static Shorts8 load(const std::int16_t* p) {
    Shorts8 loaded;
    std::memcpy(&loaded.v, p, sizeof loaded.v);
    return loaded;
  }
  static Shorts8 load(const std::int8_t* p) {
    using Bytes = std::int8_t __attribute__((vector_size(8)));
    Bytes bytes;
    std::memcpy(&bytes, p, sizeof bytes);
    return {std::bit_cast<Sums>(__builtin_convertvector(bytes, Shorts))};
  }
  static Shorts8 repeat_four(const std::int16_t* p) {
    std::int64_t four = 0;
    std::memcpy(&four, p, sizeof four);
    using Pair = std::int64_t __attribute__((vector_size(16)));
    return {std::bit_cast<Sums>(Pair{four, four})};
  }
  /// Shuffles (4 ranks)(2 positions) to (2 positions)(4 ranks).
  Shorts8 by_position() const {
    const auto s = std::bit_cast<Shorts>(v);
    return {std::bit_cast<Sums>(__builtin_shufflevector(s, s, 0, 2, 4, 6, 1, 3, 5, 7))};
  }
  friend Shorts8 add_products(const Shorts8& sum, const Shorts8& a, const Shorts8& b) {
    return {sum.v + products(a, b)};
  }
  friend Shorts8 add(const Shorts8& a, const Shorts8& b) { return {a.v + b.v}; }

  /// Magnitudes of three planes of `count` floats.
  static Magnitudes magnitudes_of_planes(const float* x, std::size_t stride, std::size_t count) {
    Magnitudes result{};
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const Magnitudes four = magnitudes_of_lanes(x + c * stride, count);
      result.largest[c] =
          std::max({four.largest[0], four.largest[1], four.largest[2], four.largest[3]});
      result.sum[c] = (four.sum[0] + four.sum[1]) + (four.sum[2] + four.sum[3]);
    }
    return result;
  }
  /// Magnitudes of each channel among `count` floats of coefficients. All instruction sets add in
  /// this order.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    std::array<float, 16> largest{}, sum{};
    for (std::size_t k = 0; k < count; ++k) {
      largest[k % 16] = std::max(largest[k % 16], std::abs(x[k]));
      sum[k % 16] += std::abs(x[k]);
    }
    Magnitudes result;
    for (std::size_t c = 0; c < kChannelLanes; ++c) {
      result.largest[c] = std::max({largest[c], largest[c + 4], largest[c + 8], largest[c + 12]});
      result.sum[c] = (sum[c] + sum[c + 8]) + (sum[c + 4] + sum[c + 12]);
    }
    return result;
  }

  static void round_positions(const float* x, float scale, std::int16_t* to) {
    for (std::size_t k = 0; k < 16; k += 2) {
      const std::int16_t a = rounded(x[k] * scale), b = rounded(x[k + 1] * scale);
      for (std::size_t r = 0; r < kRankGroup; ++r) {
        to[k * kRankGroup + 2 * r] = a;
        to[k * kRankGroup + 2 * r + 1] = b;
      }
    }
  }

  template <std::size_t kGroups>
  static void store_coefficients(const Shorts8 (&red)[kGroups], const Shorts8 (&green)[kGroups],
                                 const Shorts8 (&blue)[kGroups], const ChannelFloats& back,
                                 bool add_to, float* to) {
    for (std::size_t k = 0; k < kGroups * kRankGroup; ++k, to += kChannelLanes) {
      const Sums* const sums[] = {&red[k / kRankGroup].v, &green[k / kRankGroup].v,
                                  &blue[k / kRankGroup].v};
      for (std::size_t c = 0; c < kChannelCount; ++c) {
        const float light = static_cast<float>((*sums[c])[k % kRankGroup]) * back[c];
        to[c] = add_to ? to[c] + light : light;
      }
    }
  }

  /// Rounds a group of coefficients from (rank)(channel) to (channel)(rank).
  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales) : scale(scales) {}
    void operator()(const float* from, std::int16_t* to) const { some(from, {0, kRankGroup}, to); }
    /// Rounds only the wanted ranks; the others become zero.
    void some(const float* from, RankRange wanted, std::int16_t* to) const {
      std::fill_n(to, IntegerCoefficients::kGroupSize, std::int16_t{0});
      for (std::size_t c = 0; c < kChannelLanes; ++c) {
        for (std::size_t r = wanted.begin; r < wanted.end; ++r) {
          to[c * kRankGroup + r] = rounded(from[r * kChannelLanes + c] * scale[c]);
        }
      }
    }
    ChannelFloats scale;
  };

  /// y[k] += `back` times the sums of neighbouring lanes.
  template <std::size_t kWide>
  static void add_positions(const Shorts8 (&sum)[kWide], float back, float* y) {
    for (std::size_t w = 0; w < kWide; ++w) {
      y[2 * w] += static_cast<float>(sum[w].v[0] + sum[w].v[1]) * back;
      y[2 * w + 1] += static_cast<float>(sum[w].v[2] + sum[w].v[3]) * back;
    }
  }

 private:
  /// Sums of the products of neighbouring pairs.
  static Sums products(const Shorts8& a, const Shorts8& b) {
#if defined(__SSE2__)
    return std::bit_cast<Sums>(
        _mm_madd_epi16(std::bit_cast<__m128i>(a.v), std::bit_cast<__m128i>(b.v)));
#else
    const Sums low = ((a.v << 16) >> 16) * ((b.v << 16) >> 16);
    return low + (a.v >> 16) * (b.v >> 16);
#endif
  }
  /// Rounds to the nearest integer, ties to even.
  static std::int16_t rounded(float x) {
    return static_cast<std::int16_t>(std::lrint(std::clamp(x, -32768.0F, 32767.0F)));
  }
};

}  // namespace
}  // namespace rebounce
