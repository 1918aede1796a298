#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "runtime/rays/float3_glm.h"

namespace rebounce {

/// The corners of a triangle in metres, counter-clockwise seen from the front.
using TriangleCorners = std::array<glm::dvec3, 3>;

/// The corners of triangle `t` of a surface, which has members `position` and `triangle`.
template <typename Surface>
TriangleCorners corners_of(const Surface& surface, std::size_t t) {
  const auto [a, b, c] = surface.triangle[t];
  return {to_dvec3(surface.position[a]), to_dvec3(surface.position[b]),
          to_dvec3(surface.position[c])};
}

/// A vector along the front's normal whose length is the area, m².
inline glm::dvec3 area_vector(const TriangleCorners& p) {
  return 0.5 * glm::cross(p[1] - p[0], p[2] - p[0]);
}

/// The area, m².
inline double area_of(const TriangleCorners& p) {
  return glm::length(area_vector(p));
}

/// The unit normal of the front; not finite for a triangle without area.
inline glm::dvec3 front_normal(const TriangleCorners& p) {
  return glm::normalize(area_vector(p));
}

/// The point with weights `barycentric` of the second and third corner.
inline glm::dvec3 point_at(const TriangleCorners& p, const glm::dvec2& barycentric) {
  return p[0] + barycentric.x * (p[1] - p[0]) + barycentric.y * (p[2] - p[0]);
}

/// The weights of the three corners at `point`, which lies on the triangle.
inline glm::dvec3 weights_at(const TriangleCorners& p, const glm::dvec3& point) {
  const glm::dvec3 ab = p[1] - p[0], ac = p[2] - p[0], ap = point - p[0];
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double squared = std::max(glm::dot(normal, normal), 1e-300);
  const double v = glm::dot(glm::cross(ap, ac), normal) / squared;
  const double w = glm::dot(glm::cross(ab, ap), normal) / squared;
  return {1 - v - w, v, w};
}

}  // namespace rebounce
