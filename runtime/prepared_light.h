#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "rebounce/runtime/light_sampling.h"

namespace rebounce {

/// Light of intensity 1 from one lamp, or one place of it.
struct UnitLight {
  glm::vec3 direction{0};  ///< unit, from the point to the lamp
  float distance = 0;      ///< metres
  float illuminance = 0;   ///< lx per unit of intensity on a surface that faces it
};

/// What a light does at intensity 1, with all that does not depend on the point worked out once.
/// Two are equal if they light every point alike.
class PreparedLight {
 public:
  PreparedLight() = default;
  explicit PreparedLight(const Light& light);

  bool operator==(const PreparedLight&) const = default;

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

  /// No light arrives at points whose distance squared from position() is this or more; infinite
  /// if there is no range.
  float reach_squared() const { return reach_squared_; }
  const glm::vec3& position() const { return position_; }
  bool has_area() const { return is_area_light(type_); }

 private:
  UnitLight from_lamp(const glm::vec3& to_lamp) const;
  void from_sphere(const glm::vec3& to_center, std::span<const glm::vec2> places,
                   std::span<UnitLight> light) const;
  void from_flat(const glm::vec3& to_center, std::span<const glm::vec2> places,
                 std::span<UnitLight> light) const;
  float range_window(float distance_squared) const;
  float cone_attenuation(float cosine) const;
  float profile_candela(const glm::vec3& from_lamp) const;

  LightType type_ = LightType::kPoint;
  glm::vec3 position_{0}, direction_{0};
  glm::vec3 side_{0}, other_side_{0};  ///< unit; to the rim of a rectangle or disc
  float range_ = 0, reach_squared_ = 0;
  float cone_cosine_ = 0, cone_scale_ = 0;
  float radius_ = 0;
  float area_ = 0;  ///< m², of a rectangle or disc
  std::shared_ptr<const IntensityProfile> profile_;
};

/// A frame around the unit vector `axis`: `tangent` made perpendicular to it, and the axis of the
/// turn from there that is counter-clockwise to someone who looks along `axis`.
struct Sides {
  glm::vec3 side, other_side;
};
Sides sides_around(const glm::vec3& axis, const glm::vec3& tangent);

}  // namespace rebounce
