#pragma once

// What the vector types of AVX2 and AVX-512 share; see vector_load.h.

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "transfer/format/row_format.h"

namespace rebounce {
namespace {

struct FourSums {
  __m128 v;
  void store(float* p) const { _mm_storeu_ps(p, v); }
  void add_to(float* p, float scale) const {
    _mm_storeu_ps(p, _mm_add_ps(_mm_mul_ps(_mm_set1_ps(scale), v), _mm_loadu_ps(p)));
  }
};

/// By RowFormat::stored, what an integer of a packed row in the highest bits of 32 is multiplied
/// with.
struct StepsOfHighestBits {
  float of[256];

  constexpr StepsOfHighestBits() : of{} {
    for (unsigned stored = 0; stored < 256; ++stored) {
      const RowFormat format{static_cast<std::uint8_t>(stored)};
      of[stored] = format.step() / static_cast<float>(1U << (32 - format.bits()));
    }
  }
};
constexpr StepsOfHighestBits kStepsOfHighestBits;

/// Stores the first kCount sums of three channels; the channels of a lane are neighbours among four
/// floats.
template <std::size_t kCount>
inline void store_side_by_side(FourSums red, FourSums green, FourSums blue, float* p) {
  static_assert(kCount >= 1 && kCount <= 4);
  __m128 lane[] = {red.v, green.v, blue.v, blue.v};
  _MM_TRANSPOSE4_PS(lane[0], lane[1], lane[2], lane[3]);
  for (std::size_t k = 0; k < kCount; ++k) _mm_storeu_ps(p + 4 * k, lane[k]);
}

}  // namespace
}  // namespace rebounce
