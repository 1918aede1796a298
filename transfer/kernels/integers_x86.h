#pragma once

// What the integer vector types of AVX2 and AVX-512 share.

#include <immintrin.h>

#include "transfer/kernels/integer_kernels_impl.h"

namespace rebounce {
namespace {

/// Magnitudes of every fourth lane.
struct FourMagnitudes {
  __m128 largest, sum;

  FourMagnitudes(__m256 largest_of_eight, __m256 sum_of_eight)
      : largest(_mm_max_ps(_mm256_castps256_ps128(largest_of_eight),
                           _mm256_extractf128_ps(largest_of_eight, 1))),
        sum(_mm_add_ps(_mm256_castps256_ps128(sum_of_eight),
                       _mm256_extractf128_ps(sum_of_eight, 1))) {}

  Magnitudes magnitudes() const {
    Magnitudes result;
    _mm_storeu_ps(result.largest.data(), largest);
    _mm_storeu_ps(result.sum.data(), sum);
    return result;
  }
};

/// Sums up the lanes of three planes.
inline Magnitudes magnitudes_of_planes(const FourMagnitudes& red, const FourMagnitudes& green,
                                       const FourMagnitudes& blue) {
  __m128 m[] = {red.largest, green.largest, blue.largest, _mm_setzero_ps()};
  __m128 s[] = {red.sum, green.sum, blue.sum, _mm_setzero_ps()};
  _MM_TRANSPOSE4_PS(m[0], m[1], m[2], m[3]);
  _MM_TRANSPOSE4_PS(s[0], s[1], s[2], s[3]);
  Magnitudes result;
  _mm_storeu_ps(result.largest.data(), _mm_max_ps(_mm_max_ps(m[0], m[1]), _mm_max_ps(m[2], m[3])));
  _mm_storeu_ps(result.sum.data(), _mm_add_ps(_mm_add_ps(s[0], s[1]), _mm_add_ps(s[2], s[3])));
  return result;
}

}  // namespace
}  // namespace rebounce
