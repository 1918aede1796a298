#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "runtime/lights/light_sampling.h"

namespace rebounce {

struct LampKind;

/// Light of intensity 1 from one lamp, or one place of it.
struct UnitLight {
  glm::vec3 direction{0};  ///< unit, from the point to the lamp
  float distance = 0;      ///< metres
  float illuminance = 0;   ///< lx per unit of intensity on a surface that faces it
};

/// What a light does at intensity 1, with all that does not depend on the point worked out once.
/// Two are equal if they light every point alike. Its kind (lamp_kind.h) fills in what it uses.
struct PreparedLight {
  PreparedLight() = default;  ///< may be compared and assigned to, and no more
  explicit PreparedLight(const Light& light);

  bool operator==(const PreparedLight&) const = default;

  bool has_area() const;

  /// See evaluate_light. Not for lamps with a surface.
  UnitLight evaluate(const glm::vec3& point) const;

  /// See evaluate_light: at one point, from each of `places` of a lamp with a surface. The two are
  /// of one size.
  void evaluate_places(const glm::vec3& point, std::span<const glm::vec2> places,
                       std::span<UnitLight> light) const;

  /// The irradiance at `point` on a surface with unit `normal`, per unit of intensity, of a lamp
  /// with a surface of which nothing is hidden: closed forms, cut at the horizon, windowed by the
  /// range.
  float unoccluded_irradiance(const glm::vec3& point, const glm::vec3& normal) const;

  /// The point of a lamp with a surface that is highest above a horizon with unit `normal`.
  glm::vec3 highest_point(const glm::vec3& normal) const;

  /// 1 at the lamp's middle, 0 from its range on.
  float range_window(float distance_squared) const;

  const LampKind* kind = nullptr;
  glm::vec3 position{0}, direction{0};
  /// Perpendicular: unit with a profile, half the sides of a rectangle, radii of a disc. The second
  /// is 90 degrees on from the first, counter-clockwise to someone who looks along `direction`, as
  /// the horizontal angles of a profile run.
  glm::vec3 side{0}, other_side{0};
  /// No light arrives at points whose distance squared from the position is reach_squared or more;
  /// infinite if there is no range.
  float range = 0, reach_squared = 0;
  float cone_cosine = 0, cone_scale = 0;
  float radius = 0;
  float area = 0;  ///< m², of what shines
  std::shared_ptr<const IntensityProfile> profile;
};

}  // namespace rebounce
