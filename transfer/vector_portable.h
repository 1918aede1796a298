#pragma once

// The portable vector type of the kernels; see vector_load.h.

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
  friend Vector4 multiply_add(const Vector4& a, const Vector4& b, const Vector4& c) {
    return {{a.v[0] * b.v[0] + c.v[0], a.v[1] * b.v[1] + c.v[1], a.v[2] * b.v[2] + c.v[2],
             a.v[3] * b.v[3] + c.v[3]}};
  }
};

}  // namespace
}  // namespace rebounce
