#pragma once

// What the integer vector types of AVX2 and AVX-512 share.

#include <immintrin.h>

#include "transfer/kernels/integer_kernels_impl.h"

namespace rebounce {
namespace {

inline __m128 sum_of_halves(__m256 v) {
  return _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
}

inline __m128 largest_of_halves(__m256 v) {
  return _mm_max_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
}

/// Magnitudes of every fourth lane.
struct FourMagnitudes {
  __m128 largest, sum;

  FourMagnitudes(__m256 largest_of_eight, __m256 sum_of_eight)
      : largest(largest_of_halves(largest_of_eight)), sum(sum_of_halves(sum_of_eight)) {}

  Magnitudes magnitudes() const {
    Magnitudes result;
    _mm_storeu_ps(result.largest.data(), largest);
    _mm_storeu_ps(result.sum.data(), sum);
    return result;
  }
};

}  // namespace
}  // namespace rebounce
