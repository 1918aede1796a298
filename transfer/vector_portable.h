#pragma once

// The portable vector type of the kernels; see vector_load.h.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "half_float.h"

namespace rebounce {
namespace {

/// Four floats in plain C++: SSE2 on x86-64, NEON on AArch64, whatever there is elsewhere.
struct Vector4 {
  static constexpr std::size_t kWidth = 4;
  static constexpr std::size_t kStrip = 16;
  static constexpr std::size_t kLights = 1;
  float v[4];

  static Vector4 load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
  static Vector4 load_half(const std::uint16_t* p) {
    return {{half_to_float(p[0]), half_to_float(p[1]), half_to_float(p[2]), half_to_float(p[3])}};
  }
  static Vector4 load_bytes(const std::int8_t* p) {
    return {{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
             static_cast<float>(p[3])}};
  }
  static Vector4 load_some(const float* p, std::size_t count) {
    Vector4 some = zero();
    for (std::size_t k = 0; k < count; ++k) some.v[k] = p[k];
    return some;
  }
  static Vector4 zero() { return {{0, 0, 0, 0}}; }
  static Vector4 broadcast(float x) { return {{x, x, x, x}}; }
  void store(float* p) const { std::memcpy(p, v, sizeof v); }
  void store_some(float* p, std::size_t count) const {
    for (std::size_t k = 0; k < count; ++k) p[k] = v[k];
  }
  /// The sums over the lanes of four vectors.
  static Vector4 sums(const Vector4& a, const Vector4& b, const Vector4& c, const Vector4& d) {
    return {{a.sum(), b.sum(), c.sum(), d.sum()}};
  }
  float sum() const { return (v[0] + v[2]) + (v[1] + v[3]); }
  float largest() const { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); }

  template <typename Operation>
  static Vector4 each(const Operation& operation) {
    return {{operation(0), operation(1), operation(2), operation(3)}};
  }
  friend Vector4 add(const Vector4& a, const Vector4& b) {
    return each([&](int k) { return a.v[k] + b.v[k]; });
  }
  friend Vector4 multiply(const Vector4& a, const Vector4& b) {
    return each([&](int k) { return a.v[k] * b.v[k]; });
  }
  friend Vector4 multiply_add(const Vector4& a, const Vector4& b, const Vector4& c) {
    return each([&](int k) { return a.v[k] * b.v[k] + c.v[k]; });
  }
  friend Vector4 absolute(const Vector4& a) {
    return each([&](int k) { return std::abs(a.v[k]); });
  }
  friend Vector4 maximum(const Vector4& a, const Vector4& b) {
    return each([&](int k) { return std::max(a.v[k], b.v[k]); });
  }
};

/// Stores the first kCount lanes.
template <std::size_t kCount>
inline void store_first(const Vector4& v, float* p) {
  for (std::size_t k = 0; k < kCount; ++k) p[k] = v.v[k];
}

/// Adds the first kCount lanes to what is there.
template <std::size_t kCount>
inline void add_first(const Vector4& v, float* p) {
  for (std::size_t k = 0; k < kCount; ++k) p[k] += v.v[k];
}

}  // namespace
}  // namespace rebounce
