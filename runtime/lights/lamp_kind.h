#pragma once

// All that differs from one kind of lamp to another, in one record each. To add a kind: a
// LightType, a file beside this one that defines its record, and a case in lamp_kind.cpp.

#include <algorithm>
#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string_view>

#include "rebounce/scene_data.h"
#include "runtime/lights/lamp_field.h"
#include "runtime/lights/lamp_mesh.h"
#include "runtime/rays/patch_points.h"

namespace rebounce {

struct LampKind;

/// Light of intensity 1 from one lamp, or one place of it.
struct UnitLight {
  glm::vec3 direction{0};  ///< unit, from the point to the lamp
  float distance = 0;      ///< metres
  float illuminance = 0;   ///< lx per unit of intensity on a surface that faces it
};

/// UnitLight at the points of a block, found part by part.
struct UnitLightBlock {
  static constexpr std::size_t kPart = 16;  ///< points of a part
  using Coordinates = PatchPointBlock::Coordinates;
  std::array<Coordinates, 3> direction;
  Coordinates distance, illuminance;

  UnitLight at(std::size_t k) const {
    return {{direction[0][k], direction[1][k], direction[2][k]}, distance[k], illuminance[k]};
  }
  void set(std::size_t k, const UnitLight& light) {
    for (int axis = 0; axis < 3; ++axis) direction[axis][k] = light.direction[axis];
    distance[k] = light.distance;
    illuminance[k] = light.illuminance;
  }
};

/// A number for each point of a part of a block.
using PartValues = std::array<float, UnitLightBlock::kPart>;

/// A place of a lamp with a surface for each point of a part of a block.
struct PlacesOfPart {
  std::array<PartValues, 3> path;  ///< metres, from the point to its place
  /// What the place adds to the light of the lamp there, in a unit that all places of a point
  /// share; 0 from below the horizon.
  PartValues weight;
};

/// A light of intensity 1, with all values that do not depend on the lit point. Two are equal if
/// they light every point alike. The kind of the light fills in the members that it uses.
struct PreparedLight {
  PreparedLight() = default;  ///< may only be compared and assigned to
  explicit PreparedLight(const Light& light);

  bool operator==(const PreparedLight&) const = default;

  bool has_area() const;

  /// See evaluate_light. Not for lamps with a surface.
  UnitLight evaluate(const glm::vec3& point) const;

  /// As evaluate, at the points of part number `part` of a block.
  void evaluate(const PatchPointBlock& points, std::size_t part, UnitLightBlock& light) const;

  /// See evaluate_light: at one point, from each of `places` of a lamp with a surface. `light` has
  /// as many entries.
  void evaluate_places(const glm::vec3& point, std::span<const glm::vec2> places,
                       std::span<UnitLight> light) const;

  /// The irradiance at `point` on a surface with unit `normal`, per unit of intensity, from a lamp
  /// with a surface if nothing is in between: closed forms, cut at the horizon, times the window of
  /// the range.
  float unoccluded_irradiance(const glm::vec3& point, const glm::vec3& normal) const;

  /// The same at the points of part number `part` of a block.
  void unoccluded_irradiance(const PatchPointBlock& points, std::size_t part,
                             PartValues& irradiance) const;

  /// The point of a lamp with a surface that is highest above a horizon with unit `normal`.
  glm::vec3 highest_point(const glm::vec3& normal) const;

  /// Metres from its position within which its whole surface lies; 0 without a surface.
  float extent() const;

  /// 1 at the lamp's middle, 0 from its range on.
  float range_window(float distance_squared) const {
    // KHR_lights_punctual, "Range Property".
    const float ratio_squared = distance_squared / reach_squared;
    return std::max(0.0F, 1 - ratio_squared * ratio_squared);
  }

  const LampKind* kind = nullptr;
  glm::vec3 position{0}, direction{0};
  /// Perpendicular to each other and to `direction`: unit vectors with a profile, half the sides of
  /// a rectangle, radii of a disc. The second is 90 degrees on from the first, counter-clockwise
  /// for an observer who looks along `direction`, as the horizontal angles of a profile are.
  glm::vec3 side{0}, other_side{0};
  /// No light arrives at points whose distance squared from the position is reach_squared or more;
  /// infinite if there is no range.
  float range = 0, reach_squared = 0;
  float cone_cosine = 0, cone_scale = 0;
  float radius = 0;
  float area = 0;  ///< m², of the surface that shines
  std::shared_ptr<const IntensityProfile> profile;
};

/// The depths that a rasteriser keeps to find what a lamp sees.
enum class ShadowMapKind : std::uint8_t {
  kCube,    ///< around the lamp's position
  kPlane,   ///< seen from infinitely far, along its direction
  kPlaces,  ///< cubes around places all over its surface
};

/// The part of a LampKind that only lamps with a surface have.
struct LampSurface {
  /// As PreparedLight::evaluate_places.
  void (*evaluate_places)(const PreparedLight& lamp, const glm::vec3& point,
                          std::span<const glm::vec2> places, std::span<UnitLight> light);
  /// The places that evaluate_places takes for (u, v), one pair for each point of a part of a
  /// block.
  void (*places_of_part)(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                         const PartValues& u, const PartValues& v, PlacesOfPart& places);
  /// From a differential element to the lamp, cut at the element's horizon.
  float (*form_factor)(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal);
  /// The same at the points of a part of a block; below 0 where only form_factor tells.
  void (*form_factors)(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                       PartValues& factor);
  /// As PreparedLight::highest_point.
  glm::vec3 (*highest_point)(const PreparedLight& lamp, const glm::vec3& normal);

  /// From its middle to place k of `count` that are spread evenly over it.
  glm::vec3 (*place)(const PreparedLight& lamp, std::uint32_t k, std::uint32_t count);
  /// Triangles, seen from where it shines.
  LampMesh (*mesh)(const PreparedLight& lamp);
  /// Candela straight ahead at intensity 1, seen from afar.
  float (*candela)(const PreparedLight& lamp);
  /// The light of KHR_lights_punctual that comes nearest: a point, or a spot over its half-space.
  LightType punctual;
};

struct LampKind {
  LightType type;
  std::string_view name;                     ///< in LIGHTS.json and in the viewer
  std::string_view plural;                   ///< in messages
  std::string_view unit;                     ///< of its intensity
  std::span<const LampField* const> fields;  ///< that it uses
  ShadowMapKind shadow_map;

  /// Fills in the members of `lamp` that this kind uses; position and range are there.
  void (*prepare)(const Light& light, PreparedLight& lamp);
  /// As PreparedLight::evaluate; null if there is a surface.
  UnitLight (*evaluate)(const PreparedLight& lamp, const glm::vec3& point);
  void (*evaluate_block)(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                         UnitLightBlock& light);
  const LampSurface* surface;  ///< null if there is none
  /// False if no light arrives anywhere in a ball, even if nothing is in between; `radius` in
  /// metres. Rounding never makes it false. Looks neither at the range nor at the surface. Null if
  /// the lamp shines all around.
  bool (*may_reach)(const PreparedLight& lamp, const glm::vec3& centre, float radius) = nullptr;

  /// GLSL 3.30 of the viewer: `float NAME_irradiance(vec3 to_lamp, vec3 direction, vec3 normal)`,
  /// what arrives at intensity 1 where nothing is in between, but for the range; of lamps with a
  /// surface also `vec3 NAME_normal(vec3 place)`, its normal at a place seen from its middle.
  /// Uniforms: lamp_direction, lamp_radius, lamp_side, lamp_other_side (as PreparedLight has them),
  /// cos_inner, cos_outer; constant kPi.
  const char* glsl;
  const char* shared_glsl = "";  ///< comes before it, once for all kinds that share it

  bool uses(const LampField& field) const;
  bool has_place() const { return uses(kPosition); }
};

/// The record of `type`, which must be one of LightType.
const LampKind& lamp_kind(LightType type);

/// All of them, in the order of LightType.
std::span<const LampKind* const> lamp_kinds();

}  // namespace rebounce
