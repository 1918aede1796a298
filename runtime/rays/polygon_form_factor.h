#pragma once

#include <glm/glm.hpp>
#include <span>

namespace rebounce {

/// The form factor from a differential element at `position` with unit `normal` to a flat convex
/// polygon with three or four corners in order. Both sides of the polygon count; the part below the
/// element's horizon is cut off. In [0, 1].
float point_to_polygon_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                   std::span<const glm::vec3> corner);

}  // namespace rebounce
