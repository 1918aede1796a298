#pragma once

// The vector type of the AVX2 kernels; see vector_load.h. Needs AVX2, FMA and F16C.

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_x86.h"

namespace rebounce {
namespace {

struct Vector8 {
  static constexpr std::size_t kWidth = 8;
  static constexpr std::size_t kStrip = 16;
  static constexpr std::size_t kLights = 1;
  static constexpr std::size_t kCouplingVectors = 2;
  __m256 v;

  static Vector8 load(const float* p) { return {_mm256_loadu_ps(p)}; }
  static Vector8 load_half(const std::uint16_t* p) {
    return {_mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)))};
  }
  static Vector8 load_some(const float* p, std::size_t count) {
    return {_mm256_maskload_ps(p, first(count))};
  }
  static Vector8 repeat_four(const float* p) {
    return {_mm256_broadcast_ps(reinterpret_cast<const __m128*>(p))};
  }
  static Vector8 zero() { return {_mm256_setzero_ps()}; }
  static Vector8 broadcast(float x) { return {_mm256_set1_ps(x)}; }
  void store(float* p) const { _mm256_storeu_ps(p, v); }
  void store_some(float* p, std::size_t count) const { _mm256_maskstore_ps(p, first(count), v); }
  /// The sums over the lanes of four vectors.
  static FourSums sums(Vector8 a, Vector8 b, Vector8 c, Vector8 d) {
    const __m256 four = _mm256_hadd_ps(_mm256_hadd_ps(a.v, b.v), _mm256_hadd_ps(c.v, d.v));
    return {_mm_add_ps(_mm256_castps256_ps128(four), _mm256_extractf128_ps(four, 1))};
  }
  /// The sums over each four lanes of two vectors, one vector after the other.
  static Vector8 sums_of_fours(const Vector8 (&a)[2]) {
    return {_mm256_add_ps(_mm256_permute2f128_ps(a[0].v, a[1].v, 0x20),
                          _mm256_permute2f128_ps(a[0].v, a[1].v, 0x31))};
  }
  float sum() const {
    const __m128 half = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    const __m128 pair = _mm_add_ps(half, _mm_movehl_ps(half, half));
    return _mm_cvtss_f32(_mm_add_ss(pair, _mm_movehdup_ps(pair)));
  }
  friend Vector8 add(Vector8 a, Vector8 b) { return {_mm256_add_ps(a.v, b.v)}; }
  friend Vector8 multiply(Vector8 a, Vector8 b) { return {_mm256_mul_ps(a.v, b.v)}; }
  friend Vector8 multiply_add(Vector8 a, Vector8 b, Vector8 c) {
    return {_mm256_fmadd_ps(a.v, b.v, c.v)};
  }

  template <typename Value>
  class EntryLanes;

 private:
  static __m256i first(std::size_t count) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(count)), lane);
  }
};

template <>
class Vector8::EntryLanes<float> {
 public:
  static constexpr bool kWholeRows = false;
  explicit EntryLanes(const ChannelLanes& lanes)
      : lane_(_mm256_cvtepu16_epi32(
            _mm_load_si128(reinterpret_cast<const __m128i*>(lanes.value.data())))) {}
  Vector8 load(const float* p) const {
    return {_mm256_permutevar8x32_ps(_mm256_loadu_ps(p), lane_)};
  }

 private:
  __m256i lane_;
};

template <>
class Vector8::EntryLanes<std::uint16_t> {
 public:
  static constexpr bool kWholeRows = false;
  explicit EntryLanes(const ChannelLanes& lanes)
      : byte_(_mm_add_epi16(
            _mm_mullo_epi16(_mm_load_si128(reinterpret_cast<const __m128i*>(lanes.value.data())),
                            _mm_set1_epi16(0x0202)),
            _mm_set1_epi16(0x0100))) {}
  Vector8 load(const std::uint16_t* p) const {
    const __m128i values = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
    return {_mm256_cvtph_ps(_mm_shuffle_epi8(values, byte_))};
  }

 private:
  __m128i byte_;
};

}  // namespace
}  // namespace rebounce
