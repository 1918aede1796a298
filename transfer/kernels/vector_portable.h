#pragma once

// The portable vector type of the kernels; see vector_load.h.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include "transfer/format/row_format.h"
#include "transfer/kernels/block_kernels.h"
#include "transfer/kernels/vector_load.h"

namespace rebounce {
namespace {

/// Four floats with the vector extension of GCC and Clang: SSE2 on x86-64, NEON on AArch64,
/// otherwise what the compiler chooses.
struct Vector4 {
  using Floats = float __attribute__((vector_size(16)));
  using Bits = std::uint32_t __attribute__((vector_size(16)));
  using Integers = std::int32_t __attribute__((vector_size(16)));
  static constexpr std::size_t kWidth = 4;
  static constexpr std::size_t kStrip = 16;
  static constexpr std::size_t kLights = 1;
  static constexpr std::size_t kCouplingVectors = 4;
  Floats v;

  static Vector4 load(const float* p) { return {read<Floats>(p)}; }
  /// half_to_float of four numbers.
  static Vector4 load_half(const std::uint16_t* p) {
    using Halves = std::uint16_t __attribute__((vector_size(8)));
    const Bits half = __builtin_convertvector(read<Halves>(p), Bits);
    const Bits sign = (half & 0x8000U) << 16, magnitude = half & 0x7FFFU;
    const Bits finite = std::bit_cast<Bits>(std::bit_cast<Floats>(magnitude << 13) * 0x1p112F);
    const Bits infinite = (magnitude << 13) | 0x7F800000U;
    return {std::bit_cast<Floats>(sign | (magnitude >= 0x7C00U ? infinite : finite))};
  }
  static Vector4 load_some(const float* p, std::size_t count) {
    if (count >= kWidth) return load(p);
    float some[kWidth] = {};
    for (std::size_t k = 0; k < count; ++k) some[k] = p[k];
    return load(some);
  }
  static Vector4 repeat_four(const float* p) { return load(p); }
  static Vector4 zero() { return broadcast(0); }
  static Vector4 broadcast(float x) { return {Floats{x, x, x, x}}; }
  void store(float* p) const { std::memcpy(p, &v, sizeof v); }
  void add_to(float* p, float scale) const {
    multiply_add(broadcast(scale), *this, load(p)).store(p);
  }
  void store_some(float* p, std::size_t count) const {
    if (count >= kWidth) return store(p);
    for (std::size_t k = 0; k < count; ++k) p[k] = v[k];
  }
  /// A vector whose lanes are zero where those of both are.
  friend Vector4 any_of(const Vector4& a, const Vector4& b) {
    return {std::bit_cast<Floats>(std::bit_cast<Bits>(a.v) | std::bit_cast<Bits>(b.v))};
  }
  /// Whether any lane that any_of made of coefficients of channels is not zero. The fourth lane is
  /// unused.
  bool any_coefficient() const { return v[0] != 0 || v[1] != 0 || v[2] != 0; }
  /// The sums over the lanes of four vectors.
  static Vector4 sums(const Vector4& a, const Vector4& b, const Vector4& c, const Vector4& d) {
    return {Floats{a.sum(), b.sum(), c.sum(), d.sum()}};
  }
  static Vector4 sums_of_fours(const Vector4 (&a)[1]) { return a[0]; }
  float sum() const { return (v[0] + v[2]) + (v[1] + v[3]); }

  friend Vector4 add(const Vector4& a, const Vector4& b) { return {a.v + b.v}; }
  friend Vector4 multiply(const Vector4& a, const Vector4& b) { return {a.v * b.v}; }
  friend Vector4 multiply_add(const Vector4& a, const Vector4& b, const Vector4& c) {
    return {a.v * b.v + c.v};
  }

  /// Loads entries of a coupling matrix; the channels of an entry are neighbours.
  template <typename Value>
  class EntryLanes {
   public:
    static constexpr bool kWholeRows = false;
    explicit EntryLanes(const ChannelLanes& lanes) : lanes_(lanes) {}
    Vector4 load(const Value* p) const {
      Value four[kWidth];
      for (std::size_t k = 0; k < kWidth; ++k) four[k] = p[lanes_.value[k]];
      return load_values<Vector4>(four);
    }

   private:
    const ChannelLanes& lanes_;
  };

#if defined(__wasm_simd128__)
  /// Loads the entries of packed rows (RowFormat), like EntryLanes. An entry is the four bytes that
  /// begin with it, shifted to the left by a product, and back (lab/094).
  class PackedLanes {
    struct Place {
      v128_t bytes, factors;
    };

   public:
    explicit PackedLanes(const ChannelLanes& lanes) : matrix_count_(lanes.matrix_count) {
      for (unsigned width = 0; width < kWidths; ++width) {
        const unsigned bits = 4 * width + 4;
        for (unsigned half = 0; half < 2; ++half) {
          std::uint8_t bytes[16];
          std::uint32_t factors[kWidth];
          for (std::size_t k = 0; k < kWidth; ++k) {
            const unsigned bit = lanes.value[k] * bits + half * 4;
            for (unsigned b = 0; b < 4; ++b)
              bytes[4 * k + b] = static_cast<std::uint8_t>(bit / 8 + b);
            factors[k] = 1U << (32 - bits - bit % 8);
          }
          places_[width][half] = {wasm_v128_load(bytes), wasm_v128_load(factors)};
        }
      }
    }

    /// A row in one format.
    class Row {
     public:
      Row(const PackedLanes& lanes, RowFormat format)
          : places_(lanes.places_[format.width()]),
            half_bytes_(lanes.matrix_count_ * format.half_bytes()),
            above_(32 - format.bits()),
            step_(format.step()) {}
      /// Loads the column of a vector; reads 8 bytes.
      Vector4 load(const std::uint8_t* row, std::size_t vector) const {
        const std::size_t first = vector * half_bytes_;
        const Place& place = places_[first % 2];
        const v128_t bytes =
            wasm_i8x16_swizzle(wasm_v128_load64_zero(row + first / 2), place.bytes);
        const v128_t high = wasm_i32x4_mul(bytes, place.factors);
        return {std::bit_cast<Floats>(wasm_f32x4_convert_i32x4(wasm_i32x4_shr(high, above_)))};
      }
      /// What the loaded entries are multiplied with.
      Vector4 step() const { return broadcast(step_); }

     private:
      const Place* places_;
      std::size_t half_bytes_;
      std::uint32_t above_;
      float step_;
    };

   private:
    static constexpr unsigned kWidths = 4;
    /// Of a column that begins with a byte, and of one that begins with the second half of one.
    Place places_[kWidths][2];
    std::size_t matrix_count_;
  };
#else
  /// Loads the entries of packed rows (RowFormat), like EntryLanes.
  class PackedLanes {
   public:
    explicit PackedLanes(const ChannelLanes& lanes) : lanes_(lanes) {}

    /// A row in one format.
    class Row {
     public:
      Row(const PackedLanes& lanes, RowFormat format) : lanes_(lanes.lanes_), format_(format) {}
      /// Loads the column of a vector; reads 8 bytes.
      Vector4 load(const std::uint8_t* row, std::size_t vector) const {
        const std::size_t first = vector * lanes_.matrix_count * format_.half_bytes();
        std::uint64_t bits = 0;
        std::memcpy(&bits, row + first / 2, sizeof bits);
        bits >>= first % 2 * 4;
        Integers high;
        for (std::size_t k = 0; k < kWidth; ++k) {
          high[k] = static_cast<std::int32_t>(bits >> (lanes_.value[k] * format_.bits()));
        }
        const int above = 32 - static_cast<int>(format_.bits());
        return {__builtin_convertvector((high << above) >> above, Floats)};
      }
      /// What the loaded entries are multiplied with.
      Vector4 step() const { return broadcast(format_.step()); }

     private:
      const ChannelLanes& lanes_;
      RowFormat format_;
    };

   private:
    const ChannelLanes& lanes_;
  };
#endif

 private:
  template <typename Lanes>
  static Lanes read(const void* p) {
    Lanes lanes;
    std::memcpy(&lanes, p, sizeof lanes);
    return lanes;
  }
};

/// Stores the first kCount lanes of three channels; the channels of a lane are neighbours among
/// four floats.
template <std::size_t kCount>
inline void store_side_by_side(const Vector4& red, const Vector4& green, const Vector4& blue,
                               float* p) {
  for (std::size_t k = 0; k < kCount; ++k, p += 4) {
    p[0] = red.v[k];
    p[1] = green.v[k];
    p[2] = blue.v[k];
  }
}

}  // namespace
}  // namespace rebounce
