#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace rebounce {

/// The viridis colour map (S. van der Walt, N. Smith, 2015) at `position` in [0, 1], linear.
glm::vec3 viridis(float position);

/// A colour for an index; neighbouring indices have distinct colours. Linear.
glm::vec3 distinct_color(std::uint32_t index);

}  // namespace rebounce
