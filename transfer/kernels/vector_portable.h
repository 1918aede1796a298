#pragma once

// The portable vector type of the kernels; see vector_load.h.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

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

  /// Loads the entries of packed rows (RowFormat), like EntryLanes.
  class PackedLanes;

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

#if defined(__wasm_simd128__)
#include "transfer/kernels/packed_lanes_wasm.h"
#else
#include "transfer/kernels/packed_lanes_portable.h"
#endif
