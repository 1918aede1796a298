#pragma once

#include <array>
#include <glm/glm.hpp>

namespace rebounce {

/// The form factor from a differential element at `position` with unit `normal` to a triangle, both
/// sides of which count; what is below the element's horizon is cut off. In [0, 1].
float point_to_triangle_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                    const std::array<glm::vec3, 3>& triangle);

}  // namespace rebounce
