#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <span>

#include "runtime/rays/float3_glm.h"

namespace rebounce {

/// An axis-aligned box. A box without points meets nothing.
struct Box {
  glm::vec3 low{std::numeric_limits<float>::infinity()};
  glm::vec3 high{-std::numeric_limits<float>::infinity()};

  void add(const glm::vec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }

  glm::vec3 extent() const { return high - low; }

  /// The length of the diagonal.
  double diagonal() const { return glm::distance(glm::dvec3(low), glm::dvec3(high)); }

  /// The squared distance of `point` from the box; 0 inside.
  float distance_squared(const glm::vec3& point) const {
    const glm::vec3 apart = glm::max(glm::max(low - point, point - high), glm::vec3(0));
    return glm::dot(apart, apart);
  }

  /// True if the boxes have a point in common.
  bool meets(const Box& other) const {
    return glm::all(glm::lessThanEqual(low, other.high)) &&
           glm::all(glm::lessThanEqual(other.low, high));
  }
};

/// The smallest box around `points`.
inline Box box_around(std::span<const Float3> points) {
  Box box;
  for (const Float3& point : points) box.add(to_glm(point));
  return box;
}

}  // namespace rebounce
