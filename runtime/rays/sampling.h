#pragma once

// Low-discrepancy points, and maps from the unit square to triangles and hemispheres.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

namespace rebounce {

/// Mixes 64 bits: splitmix64 (G. Steele, D. Lea, C. Flood, 2014).
inline std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// A point of [0, 1)^2 from 64 random bits.
inline glm::dvec2 unit_square(std::uint64_t bits) {
  return {static_cast<double>(bits >> 32) * 0x1p-32,
          static_cast<double>(bits & 0xFFFFFFFFULL) * 0x1p-32};
}

/// The points fract(shift + (k + 1/2) step) of [0, 1)^2, in fixed point, where wrapping around is
/// free.
class PointSequence {
 public:
  /// `shift` and `step` are in [0, 1)^2.
  PointSequence(const glm::dvec2& shift, const glm::dvec2& step)
      : step_{to_fixed(step.x), to_fixed(step.y)},
        first_{to_fixed(shift.x) + step_[0] / 2, to_fixed(shift.y) + step_[1] / 2} {}

  glm::dvec2 operator[](std::uint32_t k) const {
    return {to_double(first_[0] + k * step_[0]), to_double(first_[1] + k * step_[1])};
  }

 private:
  static std::uint64_t to_fixed(double x) { return static_cast<std::uint64_t>(x * 0x1p63) << 1; }
  static double to_double(std::uint64_t x) {
    // The conversion of signed integers is one instruction.
    return static_cast<double>(static_cast<std::int64_t>(x >> 11)) * 0x1p-53;
  }

  std::array<std::uint64_t, 2> step_, first_;  ///< in units of 2^-64
};

/// The points of the R2 sequence (M. Roberts, 2018), shifted by `shift` modulo 1. Any run of
/// consecutive points is well distributed over [0, 1)^2.
inline PointSequence r2_sequence(const glm::dvec2& shift) {
  constexpr double kG = 1.32471795724474602596;
  return {shift, {1.0 / kG, 1.0 / (kG * kG)}};
}

/// Point k of the R2 sequence, shifted by `shift`.
inline glm::dvec2 r2_point(std::uint32_t k, const glm::dvec2& shift) {
  return r2_sequence(shift)[k];
}

/// Maps the unit square to barycentric weights of the second and third vertex, uniformly over the
/// triangle (E. Heitz, "A low-distortion map between triangle and square", 2019).
inline glm::dvec2 square_to_triangle(const glm::dvec2& s) {
  return s - 0.5 * std::min(s.x, s.y);  // without a branch that the processor would mispredict
}

/// A direction around +Z with density cos / pi, by the concentric map of P. Shirley and K. Chiu
/// (1997).
inline glm::dvec3 square_to_cosine_hemisphere(const glm::dvec2& s) {
  const double x = 2 * s.x - 1, y = 2 * s.y - 1;
  if (x == 0 && y == 0) return {0, 0, 1};
  constexpr double kQuarter = std::numbers::pi / 4;
  const bool wide = std::abs(x) > std::abs(y);
  const double r = wide ? x : y;
  const double phi = wide ? kQuarter * (y / x) : 2 * kQuarter - kQuarter * (x / y);
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0, 1 - r * r))};
}

/// An orthonormal frame with `n` as third column (T. Duff et al., 2017).
inline glm::dmat3 frame_around(const glm::dvec3& n) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  return {glm::dvec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x),
          glm::dvec3(b, sign + n.y * n.y * a, -n.y), n};
}

}  // namespace rebounce
