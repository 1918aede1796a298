#pragma once

// The integer vectors of WebAssembly's 128-bit SIMD: the portable ones, with all that rounds,
// measures and stores written for it.

#include <wasm_simd128.h>

#include <cstddef>
#include <cstdint>

#include "transfer/kernels/integers_portable.h"

namespace rebounce {
namespace {

struct IntegersWasm : Integers128 {
  static constexpr std::size_t kStrip = 16;  // lab/094
  // Sums of two groups of ranks fill twelve of the sixteen registers that x86-64 has (lab/094).
  static constexpr std::size_t kProjectedGroups = 2;

  class Rounding {
   public:
    Rounding(float scale, int below, bool is_signed)
        : scale_(wasm_f32x4_splat(scale)),
          kept_(wasm_i32x4_splat(is_signed ? -1 : (1 << kWordBits) - 1)),
          below_(static_cast<std::uint32_t>(below)) {}
    std::int32_t operator()(const float* x, std::uint8_t* to) const {
      for (std::size_t k = 0; k < kRun; k += 8) {
        wasm_v128_store(to + k * kLightBytes,
                        wasm_i16x8_narrow_i32x4(four(x + k), four(x + k + 4)));
      }
      return 0;
    }

   private:
    v128_t four(const float* x) const {
      const v128_t integers = nearest(wasm_f32x4_mul(wasm_v128_load(x), scale_));
      return wasm_v128_and(wasm_i32x4_shr(integers, below_), kept_);
    }
    v128_t scale_, kept_;
    std::uint32_t below_;
  };

  static void measure_run(const float* x, std::size_t stride, LightRun& run) {
    run = {};
    v128_t least = wasm_f32x4_splat(0);
    for (std::size_t c = 0; c < kChannelCount; ++c, x += stride) {
      v128_t magnitude[4];
      for (std::size_t k = 0; k < 4; ++k) {
        const v128_t light = wasm_v128_load(x + 4 * k);
        least = wasm_f32x4_pmin(least, light);
        magnitude[k] = wasm_f32x4_abs(light);
      }
      run.largest[c] = largest_lane(wasm_f32x4_pmax(wasm_f32x4_pmax(magnitude[0], magnitude[1]),
                                                    wasm_f32x4_pmax(magnitude[2], magnitude[3])));
      const v128_t sum = wasm_f32x4_add(wasm_f32x4_add(magnitude[0], magnitude[2]),
                                        wasm_f32x4_add(magnitude[1], magnitude[3]));
      run.sum[c] = (wasm_f32x4_extract_lane(sum, 0) + wasm_f32x4_extract_lane(sum, 2)) +
                   (wasm_f32x4_extract_lane(sum, 1) + wasm_f32x4_extract_lane(sum, 3));
    }
    run.largest[kChannelCount] = largest_lane(wasm_f32x4_abs(least));
  }

  template <std::size_t kGroups>
  static void store_coefficients(const Sum (&red)[kGroups], const Sum (&green)[kGroups],
                                 const Sum (&blue)[kGroups], const ChannelFloats& back, bool add_to,
                                 float* to) {
    for (std::size_t g = 0; g < kGroups; ++g, to += kRankGroup * kChannelLanes) {
      const v128_t r = scaled_sums(red[g], back[0]), b = scaled_sums(blue[g], back[2]);
      const v128_t gr = scaled_sums(green[g], back[1]), none = wasm_f32x4_splat(0);
      const v128_t rg01 = wasm_i32x4_shuffle(r, gr, 0, 4, 1, 5);
      const v128_t rg23 = wasm_i32x4_shuffle(r, gr, 2, 6, 3, 7);
      const v128_t b01 = wasm_i32x4_shuffle(b, none, 0, 4, 1, 5);
      const v128_t b23 = wasm_i32x4_shuffle(b, none, 2, 6, 3, 7);
      const v128_t ranks[kRankGroup] = {
          wasm_i64x2_shuffle(rg01, b01, 0, 2), wasm_i64x2_shuffle(rg01, b01, 1, 3),
          wasm_i64x2_shuffle(rg23, b23, 0, 2), wasm_i64x2_shuffle(rg23, b23, 1, 3)};
      for (std::size_t k = 0; k < kRankGroup; ++k) {
        float* const at = to + k * kChannelLanes;
        wasm_v128_store(at, add_to ? wasm_f32x4_add(wasm_v128_load(at), ranks[k]) : ranks[k]);
      }
    }
  }

  /// `count` is a multiple of kChannelLanes.
  static Magnitudes magnitudes_of_lanes(const float* x, std::size_t count) {
    constexpr std::size_t kVectors = 8;
    v128_t sum[kVectors], largest = wasm_f32x4_splat(0);
    for (v128_t& lanes : sum) lanes = wasm_f32x4_splat(0);
    const auto add = [&](std::size_t k, const float* lanes) {
      const v128_t magnitude = wasm_f32x4_abs(wasm_v128_load(lanes));
      sum[k] = wasm_f32x4_add(sum[k], magnitude);
      largest = wasm_f32x4_pmax(largest, magnitude);
    };
    for (; count >= kVectors * kChannelLanes; count -= kVectors * kChannelLanes) {
      for (std::size_t k = 0; k < kVectors; ++k, x += kChannelLanes) add(k, x);
    }
    for (std::size_t k = 0; k < count / kChannelLanes; ++k, x += kChannelLanes) add(k, x);
    for (std::size_t k = 0; k < kVectors / 2; ++k) {
      sum[k] = wasm_f32x4_add(sum[k], sum[k + kVectors / 2]);
    }
    Magnitudes result;
    wasm_v128_store(result.largest.data(), largest);
    wasm_v128_store(result.sum.data(),
                    wasm_f32x4_add(wasm_f32x4_add(sum[0], sum[2]), wasm_f32x4_add(sum[1], sum[3])));
    return result;
  }

  struct CoefficientRounding {
    explicit CoefficientRounding(const ChannelFloats& scales)
        : scale(wasm_f32x4_make(scales[0], scales[1], scales[2], 0)) {}
    bool operator()(const float* from, std::int16_t* to) const {
      return some(from, {0, kRankGroup}, to);
    }
    bool some(const float* from, RankRange wanted, std::int16_t* to) const {
      v128_t rank[kRankGroup];
      for (std::size_t r = 0; r < kRankGroup; ++r) {
        const bool is_wanted = wanted.begin <= r && r < wanted.end;
        rank[r] = is_wanted
                      ? nearest(wasm_f32x4_mul(wasm_v128_load(from + r * kChannelLanes), scale))
                      : wasm_i32x4_splat(0);
      }
      // (channel) of ranks 0 and 2, and of 1 and 3; the largest and least words are kept in range.
      const v128_t even = wasm_i16x8_narrow_i32x4(rank[0], rank[2]);
      const v128_t odd = wasm_i16x8_narrow_i32x4(rank[1], rank[3]);
      const v128_t red_green = wasm_i16x8_shuffle(even, odd, 0, 4, 8, 12, 1, 5, 9, 13);
      const v128_t blue = wasm_i16x8_shuffle(even, odd, 2, 6, 10, 14, 3, 7, 11, 15);
      wasm_v128_store(to, red_green);
      wasm_v128_store(to + 2 * kRankGroup, blue);
      return wasm_v128_any_true(wasm_v128_or(red_green, blue));
    }
    v128_t scale;
  };

 private:
  /// Rounds to the nearest integers, ties to even.
  static v128_t nearest(v128_t x) { return wasm_i32x4_trunc_sat_f32x4(wasm_f32x4_nearest(x)); }

  static float largest_lane(v128_t x) {
    const v128_t two = wasm_f32x4_pmax(x, wasm_i32x4_shuffle(x, x, 2, 3, 0, 1));
    return wasm_f32x4_extract_lane(wasm_f32x4_pmax(two, wasm_i32x4_shuffle(two, two, 1, 0, 3, 2)),
                                   0);
  }

  /// The sums of four ranks over both pairs of positions, times `back`.
  static v128_t scaled_sums(const Sum& sum, float back) {
    const auto low = std::bit_cast<v128_t>(sum.low), high = std::bit_cast<v128_t>(sum.high);
    const v128_t pairs = wasm_i32x4_add(wasm_i32x4_shuffle(low, high, 0, 2, 4, 6),
                                        wasm_i32x4_shuffle(low, high, 1, 3, 5, 7));
    return wasm_f32x4_mul(wasm_f32x4_convert_i32x4(pairs), wasm_f32x4_splat(back));
  }
};

}  // namespace
}  // namespace rebounce
