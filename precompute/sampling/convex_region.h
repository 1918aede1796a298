#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "runtime/rays/box.h"

namespace rebounce {

/// The points for which dot(normal, point) <= limit.
struct HalfSpace {
  glm::dvec3 normal;
  double limit;  ///< metres if `normal` is a unit vector
};

/// The intersection of a box along the axes with any number of half-spaces.
struct ConvexRegion {
  Box box;
  std::vector<HalfSpace> sides;

  /// False if `other` lies outside one of the half-spaces or outside the box of the region. It is
  /// never false for a box around a segment for which the other overload is true, not even by
  /// rounding.
  bool may_meet(const Box& other) const {
    if (!box.meets(other)) return false;
    for (const auto& [normal, limit] : sides) {
      const glm::dvec3 nearest(normal.x > 0 ? other.low.x : other.high.x,
                               normal.y > 0 ? other.low.y : other.high.y,
                               normal.z > 0 ? other.low.z : other.high.z);
      if (glm::dot(normal, nearest) > limit) return false;
    }
    return true;
  }

  /// The same for a segment.
  bool may_meet(const glm::vec3& begin, const glm::vec3& end) const {
    Box segment;
    segment.add(begin);
    segment.add(end);
    if (!box.meets(segment)) return false;
    for (const auto& [normal, limit] : sides) {
      if (glm::dot(normal, glm::dvec3(begin)) > limit &&
          glm::dot(normal, glm::dvec3(end)) > limit) {
        return false;
      }
    }
    return true;
  }
};

}  // namespace rebounce
