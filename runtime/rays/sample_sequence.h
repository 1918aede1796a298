#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

namespace rebounce {

/// A well-mixed function of its argument (the finalizer of MurmurHash3).
inline std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bU;
  x ^= x >> 13;
  x *= 0xc2b2ae35U;
  return x ^ (x >> 16);
}

/// A number in [0, 1) for each (`seed`, `dimension`).
inline float hash_to_unit(std::uint32_t seed, std::uint32_t dimension) {
  return static_cast<float>(hash(hash(seed) + 0x9e3779b9U * (dimension + 1)) >> 8) * 0x1p-24F;
}

/// Point `index` of the R2 sequence (M. Roberts, "The Unreasonable Effectiveness of Quasirandom
/// Sequences", 2018), shifted by `shift` around the unit square.
inline glm::vec2 r2_point(std::uint32_t index, const glm::vec2& shift) {
  constexpr double kStepX = 0.7548776662466927;
  constexpr double kStepY = 0.5698402909980532;
  const double x = shift.x + kStepX * index, y = shift.y + kStepY * index;
  return {static_cast<float>(x - std::floor(x)), static_cast<float>(y - std::floor(y))};
}

}  // namespace rebounce
