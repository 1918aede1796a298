#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "runtime/rays/sampling.h"

namespace rebounce {

/// Barycentric weights of the second and third corner at the middle of a triangle.
inline const glm::dvec2 kTriangleCentre(1.0 / 3);

/// Those of point `k` of `count` that are spread over a triangle; the middle if there is only one.
inline glm::dvec2 triangle_point(std::uint32_t k, std::uint32_t count) {
  return count == 1 ? kTriangleCentre : square_to_triangle(r2_point(k, glm::dvec2(0)));
}

}  // namespace rebounce
