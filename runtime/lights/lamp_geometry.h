#pragma once

// Geometry that several kinds of lamps share.

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <span>

#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/lamp_mesh.h"

namespace rebounce {

/// A frame around the unit vector `axis`: `tangent` made perpendicular to it, and the vector 90
/// degrees on from there, counter-clockwise for an observer who looks along `axis`.
struct Sides {
  glm::vec3 side, other_side;
};
Sides sides_around(const glm::vec3& axis, const glm::vec3& tangent);

/// A coordinate axis that is not parallel to the unit vector `v`.
glm::vec3 least_axis(const glm::vec3& v);

/// Prepares `lamp` for its profile, if `light` has one.
void prepare_profile(const Light& light, PreparedLight& lamp);

/// The light of a point lamp at `point`, or at the points of a part of a block: inverse square and
/// range (KHR_lights_punctual, "Range Property"). No light at the lamp itself: a point inside it
/// has no direction to it.
UnitLight inverse_square(const PreparedLight& lamp, const glm::vec3& point);
void inverse_square(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    UnitLightBlock& light);

/// Multiplies `light` by the candelas of the lamp's profile, if it has one.
void apply_profile(const PreparedLight& lamp, UnitLight& light);
void apply_profile(const PreparedLight& lamp, std::size_t part, UnitLightBlock& light);

/// The path to `end` from point `k` of a block, metres. In numbers, since loops over vectors of GLM
/// are not vectorised.
struct PathFromPoint {
  float x, y, z;

  PathFromPoint(const glm::vec3& end, const PatchPointBlock& points, std::size_t k)
      : x(end.x - points.position[0][k]),
        y(end.y - points.position[1][k]),
        z(end.z - points.position[2][k]) {}

  float squared() const { return x * x + y * y + z * z; }
  float along(const glm::vec3& axis) const { return x * axis.x + y * axis.y + z * axis.z; }
  /// Over the horizon of the point.
  float height(const PatchPointBlock& points, std::size_t k) const {
    return x * points.normal[0][k] + y * points.normal[1][k] + z * points.normal[2][k];
  }
};

/// Point k of a golden-angle spiral around the unit circle.
glm::vec2 golden_turn(std::uint32_t k);

/// Unit square to unit disc, areas in proportion (P. Shirley, K. Chiu, "A low distortion map
/// between disk and square", 1997). Without branches and calls, for loops that are vectorised; to
/// 3e-8.
inline void square_to_disc(float u, float v, float& x, float& y) {
  const float a = 2 * u - 1, b = 2 * v - 1;
  const bool wide = std::abs(a) > std::abs(b);
  const float r = wide ? a : b, other = wide ? b : a;
  const float t = 0.25F * std::numbers::pi_v<float> * other / (r == 0 ? 1.0F : r), tt = t * t;
  // Taylor's series, for up to an eighth of a turn.
  const float sine = t * (1 - tt / 6 * (1 - tt / 20 * (1 - tt / 42 * (1 - tt / 72))));
  const float cosine = 1 - tt / 2 * (1 - tt / 12 * (1 - tt / 30 * (1 - tt / 56)));
  x = r * (wide ? cosine : sine);
  y = r * (wide ? sine : cosine);
}

// ---- Flat one-sided lamps, around `position`, spanned by `side` and `other_side`

/// The light of one sample point of the lamp, at `at` in units of its sides from the centre.
/// `to_center`: from the receiver to the centre, metres; `area`: of the lamp, m², times the window
/// of the range.
UnitLight from_flat_place(const PreparedLight& lamp, const glm::vec3& to_center, float area,
                          const glm::vec2& at);

/// As LampSurface::places_of_part, with places in units of the sides.
void flat_places(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                 const PartValues& x, const PartValues& y, PlacesOfPart& places);

/// A triangle fan around the centre of a lamp. `rim` is in units of its sides, clockwise for an
/// observer who looks along `direction`.
LampMesh flat_mesh(const PreparedLight& lamp, std::span<const glm::vec2> rim);

/// From the centre to `at`, with the second side reversed: seen from the lit side, x points right
/// and y up.
glm::vec3 from_middle(const PreparedLight& lamp, const glm::vec2& at);

/// GLSL that defines flat_irradiance(to_center, normal, corners).
extern const char kFlatGlsl[];

}  // namespace rebounce
