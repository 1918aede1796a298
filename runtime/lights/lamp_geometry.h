#pragma once

// What several kinds of lamps share.

#include <glm/glm.hpp>
#include <span>

#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/lamp_mesh.h"

namespace rebounce {

/// A frame around the unit vector `axis`: `tangent` made perpendicular to it, and the axis of the
/// turn from there that is counter-clockwise to someone who looks along `axis`.
struct Sides {
  glm::vec3 side, other_side;
};
Sides sides_around(const glm::vec3& axis, const glm::vec3& tangent);

/// An axis of the world that does not lie along the unit vector.
glm::vec3 least_axis(const glm::vec3& v);

/// Makes `lamp` ready for its profile, if `light` has one.
void prepare_profile(const Light& light, PreparedLight& lamp);

/// From a lamp at one place: inverse square and range (KHR_lights_punctual, "Range Property").
/// Nothing at the place itself.
UnitLight inverse_square(const PreparedLight& lamp, const glm::vec3& point);

/// `light` times the candela of the lamp's profile, if it has one.
void apply_profile(const PreparedLight& lamp, UnitLight& light);

/// Place k of a spiral of the golden angle around the unit circle.
glm::vec2 golden_turn(std::uint32_t k);

// ---- Flat lamps, which shine to one side: around `position`, reached by `side` and `other_side`

/// The light of one place of the lamp, off its middle by `at` in parts of its sides. `to_center`:
/// from the point to its middle; `area`: that of the lamp times the window of the range.
UnitLight from_flat_place(const PreparedLight& lamp, const glm::vec3& to_center, float area,
                          const glm::vec2& at);

/// A fan around the middle of a lamp whose rim is at each of `rim` in parts of its sides, turned
/// clockwise to someone who looks along `direction`.
LampMesh flat_mesh(const PreparedLight& lamp, std::span<const glm::vec2> rim);

/// From the middle to `at`, counted against the second side: seen from where the lamp shines, x and
/// y are then as on paper.
glm::vec3 from_middle(const PreparedLight& lamp, const glm::vec2& at);

/// Defines flat_irradiance(to_center, normal, corners).
extern const char kFlatGlsl[];

}  // namespace rebounce
