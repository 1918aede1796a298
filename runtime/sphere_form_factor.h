#pragma once

#include <glm/glm.hpp>

namespace rebounce {

/// The form factor from a differential element at the origin with unit `normal` to a sphere whose
/// middle is at `to_center`; what is below the element's horizon is cut off. 1 from within the
/// sphere.
float point_to_sphere_form_factor(const glm::vec3& to_center, const glm::vec3& normal,
                                  float radius);

}  // namespace rebounce
