#pragma once

// The vector type of the AVX-512 kernels; see vector_load.h. Needs AVX-512F.

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

namespace rebounce {
namespace {

struct Vector16 {
  static constexpr std::size_t kWidth = 16;
  __m512 v;

  static Vector16 load(const float* p) { return {_mm512_loadu_ps(p)}; }
  static Vector16 load_half(const std::uint16_t* p) {
    return {_mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)))};
  }
  static Vector16 zero() { return {_mm512_setzero_ps()}; }
  static Vector16 broadcast(float x) { return {_mm512_set1_ps(x)}; }
  void store(float* p) const { _mm512_storeu_ps(p, v); }
  float sum() const { return _mm512_reduce_add_ps(v); }
  friend Vector16 multiply_add(Vector16 a, Vector16 b, Vector16 c) {
    return {_mm512_fmadd_ps(a.v, b.v, c.v)};
  }
};

}  // namespace
}  // namespace rebounce
