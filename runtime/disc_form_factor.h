#pragma once

#include <glm/glm.hpp>

namespace rebounce {

/// The form factor from a differential element at the origin with unit `normal` to a disc of
/// `radius` around `to_center`, perpendicular to the unit vector `axis`, seen from either side;
/// what is below the element's horizon is cut off. 0 from within its plane.
float point_to_disc_form_factor(const glm::vec3& to_center, const glm::vec3& normal,
                                const glm::vec3& axis, float radius);

}  // namespace rebounce
