#pragma once

// What the vector types of AVX2 and AVX-512 share; see vector_load.h.

#include <immintrin.h>

#include <cstddef>

namespace rebounce {
namespace {

struct FourSums {
  __m128 v;
};

/// Stores the first kCount lanes, four at most.
template <std::size_t kCount>
inline void store_first(FourSums sums, float* p) {
  const __m128 v = sums.v;
  static_assert(kCount >= 1 && kCount <= 4);
  if constexpr (kCount == 4) {
    _mm_storeu_ps(p, v);
  } else if constexpr (kCount == 1) {
    _mm_store_ss(p, v);
  } else {
    _mm_storel_pi(reinterpret_cast<__m64*>(p), v);
    if constexpr (kCount == 3) _mm_store_ss(p + 2, _mm_movehl_ps(v, v));
  }
}

/// Adds the first kCount lanes to what is there.
template <std::size_t kCount>
inline void add_first(FourSums sums, float* p) {
  float lanes[4];
  _mm_storeu_ps(lanes, sums.v);
  for (std::size_t k = 0; k < kCount; ++k) p[k] += lanes[k];
}

}  // namespace
}  // namespace rebounce
