#pragma once

// The vector type of the AVX-512 kernels; see vector_load.h. Needs AVX-512 F, BW and VL.

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"
#include "transfer/kernels/vector_x86.h"

namespace rebounce {
namespace {

struct Vector16 {
  static constexpr std::size_t kWidth = 16;
  static constexpr std::size_t kStrip = 64;
  static constexpr std::size_t kLights = 2;
  static constexpr std::size_t kCouplingVectors = 4;
  __m512 v;

  static Vector16 load(const float* p) { return {_mm512_loadu_ps(p)}; }
  static Vector16 load_half(const std::uint16_t* p) {
    return {_mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)))};
  }
  static Vector16 load_some(const float* p, std::size_t count) {
    return {_mm512_maskz_loadu_ps(first(count), p)};
  }
  static Vector16 repeat_four(const float* p) { return {_mm512_broadcast_f32x4(_mm_loadu_ps(p))}; }
  static Vector16 zero() { return {_mm512_setzero_ps()}; }
  static Vector16 broadcast(float x) { return {_mm512_set1_ps(x)}; }
  void store(float* p) const { _mm512_storeu_ps(p, v); }
  void add_to(float* p, float scale) const {
    multiply_add(broadcast(scale), *this, load(p)).store(p);
  }
  void store_some(float* p, std::size_t count) const { _mm512_mask_storeu_ps(p, first(count), v); }
  float sum() const { return _mm512_reduce_add_ps(v); }
  /// A vector whose lanes are zero where those of both are.
  friend Vector16 any_of(Vector16 a, Vector16 b) {
    return {
        _mm512_castsi512_ps(_mm512_or_si512(_mm512_castps_si512(a.v), _mm512_castps_si512(b.v)))};
  }
  /// Whether any lane that any_of made of coefficients of channels is not zero. The fourth lane of
  /// each is unused.
  bool any_coefficient() const {
    return _mm512_mask_cmp_ps_mask(0x7777, v, _mm512_setzero_ps(), _CMP_NEQ_UQ) != 0;
  }
  /// The sums over the lanes of four vectors.
  static FourSums sums(Vector16 a, Vector16 b, Vector16 c, Vector16 d) {
    const __m512 ab = _mm512_add_ps(_mm512_unpacklo_ps(a.v, b.v), _mm512_unpackhi_ps(a.v, b.v));
    const __m512 cd = _mm512_add_ps(_mm512_unpacklo_ps(c.v, d.v), _mm512_unpackhi_ps(c.v, d.v));
    const __m512 four =
        _mm512_add_ps(_mm512_shuffle_ps(ab, cd, 0x44), _mm512_shuffle_ps(ab, cd, 0xEE));
    const __m256 two =
        _mm256_add_ps(_mm512_castps512_ps256(four),
                      _mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(four), 1)));
    return {_mm_add_ps(_mm256_castps256_ps128(two), _mm256_extractf128_ps(two, 1))};
  }
  /// The sums over each four lanes of four vectors, one vector after the other.
  static Vector16 sums_of_fours(const Vector16 (&a)[4]) {
    const auto halves = [](__m512 x, __m512 y) REBOUNCE_INLINE {
      return _mm512_add_ps(_mm512_shuffle_f32x4(x, y, 0x88), _mm512_shuffle_f32x4(x, y, 0xDD));
    };
    return {halves(halves(a[0].v, a[1].v), halves(a[2].v, a[3].v))};
  }
  /// Sums every fourth lane of four vectors; vector k is in lane k of each four.
  static Vector16 sums_in_fours(const Vector16 (&a)[4]) {
    const auto pair = [](__m512 x, __m512 y) REBOUNCE_INLINE {
      return _mm512_add_ps(_mm512_unpacklo_ps(x, y), _mm512_unpackhi_ps(x, y));
    };
    const __m512 ab = pair(a[0].v, a[1].v), cd = pair(a[2].v, a[3].v);
    return {_mm512_add_ps(_mm512_shuffle_ps(ab, cd, 0x44), _mm512_shuffle_ps(ab, cd, 0xEE))};
  }
  /// The sums over the lanes of four vectors of each channel, (vector)(channel).
  static Vector16 sums_side_by_side(const Vector16 (&red)[4], const Vector16 (&green)[4],
                                    const Vector16 (&blue)[4]) {
    const auto pair = [](Vector16 a, Vector16 b) REBOUNCE_INLINE {  // (a)(b)(a)(b) in each four
      return _mm512_add_ps(_mm512_unpacklo_ps(a.v, b.v), _mm512_unpackhi_ps(a.v, b.v));
    };
    const __m512 blues[2] = {pair(blue[0], blue[1]), pair(blue[2], blue[3])};
    const auto even = [&](int k) REBOUNCE_INLINE -> Vector16 {
      const __m512 rg = pair(red[k], green[k]), b = blues[k / 2];
      return {_mm512_add_ps(_mm512_shuffle_ps(rg, b, 0x44), _mm512_shuffle_ps(rg, b, 0xEE))};
    };
    const auto odd = [&](int k) REBOUNCE_INLINE -> Vector16 {
      const __m512 rg = pair(red[k], green[k]), b = blues[k / 2];
      return {_mm512_add_ps(_mm512_shuffle_ps(rg, b, 0x14), _mm512_shuffle_ps(rg, b, 0xBE))};
    };
    const Vector16 row[4] = {even(0), odd(1), even(2), odd(3)};
    return sums_of_fours(row);
  }
  friend Vector16 add(Vector16 a, Vector16 b) { return {_mm512_add_ps(a.v, b.v)}; }
  friend Vector16 multiply(Vector16 a, Vector16 b) { return {_mm512_mul_ps(a.v, b.v)}; }
  friend Vector16 multiply_add(Vector16 a, Vector16 b, Vector16 c) {
    return {_mm512_fmadd_ps(a.v, b.v, c.v)};
  }

  template <typename Value>
  class EntryLanes;
  class OneMatrixEntries;

  /// Loads the entries of packed rows (RowFormat), like EntryLanes.
  class PackedLanes {
   public:
    explicit PackedLanes(const ChannelLanes& lanes) {
      const __m512i value = _mm512_cvtepu16_epi32(
          _mm256_load_si256(reinterpret_cast<const __m256i*>(lanes.value.data())));
      for (int k = 0; k < 4; ++k) {
        const int bits = 4 * k + 4;
        const __m512i bit = _mm512_mullo_epi32(value, _mm512_set1_epi32(bits));
        const __m512i word = _mm512_srli_epi32(bit, 4);
        const __m512i next = _mm512_add_epi32(word, _mm512_set1_epi32(1));
        words_[k] = _mm512_or_si512(word, _mm512_slli_epi32(next, 16));
        left_[k] = _mm512_sub_epi32(_mm512_set1_epi32(32 - bits),
                                    _mm512_and_si512(bit, _mm512_set1_epi32(15)));
        used_[k] = _mm512_set1_epi32(-1 << (32 - bits));
        bytes_[k] = kWidth / kChannelLanes * lanes.matrix_count * static_cast<unsigned>(bits) / 8;
      }
    }

    /// A row in one format. An entry is the two words that hold it, shifted to the left.
    class Row {
     public:
      Row(const PackedLanes& lanes, RowFormat format)
          : words_(lanes.words_[format.width()]),
            left_(lanes.left_[format.width()]),
            used_(lanes.used_[format.width()]),
            bytes_(lanes.bytes_[format.width()]),
            step_(_mm512_set1_ps(kStepsOfHighestBits.of[format.stored])) {}
      /// Loads the four columns of a vector; reads 32 bytes.
      Vector16 load(const std::uint8_t* row, std::size_t vector) const {
        const __m512i words = _mm512_castsi256_si512(
            _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + vector * bytes_)));
        const __m512i high = _mm512_sllv_epi32(_mm512_permutexvar_epi16(words_, words), left_);
        return {_mm512_cvtepi32_ps(_mm512_and_si512(high, used_))};
      }
      /// What the loaded entries are multiplied with.
      Vector16 step() const { return {step_}; }

     private:
      __m512i words_, left_, used_;
      std::size_t bytes_;
      __m512 step_;
    };

   private:
    __m512i words_[4], left_[4], used_[4];  // by width
    std::size_t bytes_[4];                  // of a vector
  };

 private:
  static __mmask16 first(std::size_t count) { return static_cast<__mmask16>((1U << count) - 1); }
};

template <>
class Vector16::EntryLanes<float> {
 public:
  static constexpr bool kWholeRows = false;
  explicit EntryLanes(const ChannelLanes& lanes)
      : lane_(_mm512_cvtepu16_epi32(
            _mm256_load_si256(reinterpret_cast<const __m256i*>(lanes.value.data())))) {}
  Vector16 load(const float* p) const { return {_mm512_permutexvar_ps(lane_, _mm512_loadu_ps(p))}; }

 private:
  __m512i lane_;
};

template <>
class Vector16::EntryLanes<std::uint16_t> {
 public:
  static constexpr bool kWholeRows = false;
  explicit EntryLanes(const ChannelLanes& lanes)
      : lane_(_mm512_cvtepu16_epi32(
            _mm256_load_si256(reinterpret_cast<const __m256i*>(lanes.value.data())))) {}
  // Halves are converted straight from memory: this saves one operation against converting permuted
  // values.
  Vector16 load(const std::uint16_t* p) const {
    return {_mm512_permutexvar_ps(lane_, load_half(p).v)};
  }

 private:
  __m512i lane_;
};

/// With one matrix for all channels, the sixteen entries of four vectors are converted once.
class Vector16::OneMatrixEntries {
 public:
  static constexpr bool kWholeRows = true;
  explicit OneMatrixEntries(const ChannelLanes&) {
    const __m512i first = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    for (int w = 0; w < 4; ++w) lane_[w] = _mm512_add_epi32(first, _mm512_set1_epi32(4 * w));
  }
  template <std::size_t kWide, typename Value>
  void load_row(const Value* p, Vector16 (&b)[kWide]) const {
    static_assert(kWide <= 4);
    const Vector16 row = load_values<Vector16>(p);
    for (std::size_t w = 0; w < kWide; ++w) b[w] = {_mm512_permutexvar_ps(lane_[w], row.v)};
  }

 private:
  __m512i lane_[4];
};

}  // namespace
}  // namespace rebounce
