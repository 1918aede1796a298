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
  float v[4];

  static Vector4 load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
  static Vector4 load_half(const std::uint16_t* p) {
    return {{half_to_float(p[0]), half_to_float(p[1]), half_to_float(p[2]), half_to_float(p[3])}};
  }
  static Vector4 zero() { return {{0, 0, 0, 0}}; }
  static Vector4 broadcast(float x) { return {{x, x, x, x}}; }
  void store(float* p) const { std::memcpy(p, v, sizeof v); }
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

}  // namespace
}  // namespace rebounce
