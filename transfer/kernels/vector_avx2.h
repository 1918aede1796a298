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
  /// A vector whose lanes are zero where those of both are.
  friend Vector8 any_of(Vector8 a, Vector8 b) { return {_mm256_or_ps(a.v, b.v)}; }
  /// Whether any lane that any_of made of coefficients of channels is not zero. The fourth lane of
  /// each is unused.
  bool any_coefficient() const {
    constexpr int kUsedLanes = 0x77;
    const __m256 is_light = _mm256_cmp_ps(v, _mm256_setzero_ps(), _CMP_NEQ_UQ);
    return (_mm256_movemask_ps(is_light) & kUsedLanes) != 0;
  }
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

  /// Loads the entries of packed rows (RowFormat), like EntryLanes.
  class PackedLanes {
   public:
    explicit PackedLanes(const ChannelLanes& lanes) {
      const __m256i value = _mm256_cvtepu16_epi32(
          _mm_load_si128(reinterpret_cast<const __m128i*>(lanes.value.data())));
      for (int k = 0; k < 4; ++k) {
        const int bits = 4 * k + 4;
        const __m256i bit = _mm256_mullo_epi32(value, _mm256_set1_epi32(bits));
        const __m256i byte =
            _mm256_mullo_epi32(_mm256_srli_epi32(bit, 3), _mm256_set1_epi32(0x01010101));
        bytes_[k] = _mm256_add_epi32(byte, _mm256_set1_epi32(0x03020100));
        left_[k] = _mm256_sub_epi32(_mm256_set1_epi32(32 - bits),
                                    _mm256_and_si256(bit, _mm256_set1_epi32(7)));
        used_[k] = _mm256_set1_epi32(-1 << (32 - bits));
        vector_bytes_[k] =
            kWidth / kChannelLanes * lanes.matrix_count * static_cast<unsigned>(bits) / 8;
      }
    }

    /// A row in one format. An entry is the four bytes that begin with it, shifted to the left.
    class Row {
     public:
      Row(const PackedLanes& lanes, RowFormat format)
          : bytes_(lanes.bytes_[format.width()]),
            left_(lanes.left_[format.width()]),
            used_(lanes.used_[format.width()]),
            vector_bytes_(lanes.vector_bytes_[format.width()]),
            step_(_mm256_set1_ps(kStepsOfHighestBits.of[format.stored])) {}
      /// Loads the two columns of a vector; reads 16 bytes.
      Vector8 load(const std::uint8_t* row, std::size_t vector) const {
        const __m256i bytes = _mm256_broadcastsi128_si256(
            _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + vector * vector_bytes_)));
        const __m256i high = _mm256_sllv_epi32(_mm256_shuffle_epi8(bytes, bytes_), left_);
        return {_mm256_cvtepi32_ps(_mm256_and_si256(high, used_))};
      }
      /// What the loaded entries are multiplied with.
      Vector8 step() const { return {step_}; }

     private:
      __m256i bytes_, left_, used_;
      std::size_t vector_bytes_;
      __m256 step_;
    };

   private:
    __m256i bytes_[4], left_[4], used_[4];  // by width
    std::size_t vector_bytes_[4];
  };

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
