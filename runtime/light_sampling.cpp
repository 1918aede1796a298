#include "rebounce/runtime/light_sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prepared_light.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

bool is_finite(const Float3& v) {
  return std::ranges::all_of(v, [](float x) { return std::isfinite(x); });
}

void require(bool good, const char* field, const char* wanted) {
  if (!good) throw Error(std::string("a light's ") + field + " must be " + wanted);
}

void check_axes(const Light& light) {
  const glm::vec3 direction = to_glm(light.direction), tangent = to_glm(light.tangent);
  require(std::abs(glm::length(direction) - 1) < 1e-3F, "direction", "a unit vector");
  if (light.type != LightType::kRectangle && !light.profile) return;
  require(is_finite(light.tangent) &&
              glm::length(glm::cross(direction, tangent)) > 1e-6F * glm::length(tangent),
          "tangent", "a vector that is not along its direction");
}

}  // namespace

IncidentLight evaluate_light(const Light& light, const Float3& point, const Float2& place) {
  const PreparedLight prepared(light);
  UnitLight unit;
  if (prepared.has_area()) {
    const glm::vec2 from = to_glm(place);
    prepared.evaluate_places(to_glm(point), {&from, 1}, {&unit, 1});
  } else {
    unit = prepared.evaluate(to_glm(point));
  }
  return {.direction = to_float3(unit.direction),
          .distance = unit.distance,
          .illuminance = to_float3(to_glm(light.color) * light.intensity * unit.illuminance)};
}

void check_light(const Light& light) {
  const auto is_factor = [](float x) { return std::isfinite(x) && x >= 0; };
  const auto is_length = [](float x) { return std::isfinite(x) && x > 0; };
  require(is_finite(light.position), "position", "finite");
  require(std::ranges::all_of(light.color, is_factor), "color", "at least 0");
  require(is_factor(light.intensity), "intensity", "at least 0");
  require(is_factor(light.range), "range", "at least 0");
  if (light.type != LightType::kSphere && (light.type != LightType::kPoint || light.profile)) {
    check_axes(light);
  }
  if (light.type == LightType::kSpot) {
    require(light.outer_cone_angle <= std::numbers::pi_v<float> / 2, "outer cone angle",
            "at most pi / 2");
    require(light.inner_cone_angle >= 0 && light.inner_cone_angle <= light.outer_cone_angle,
            "inner cone angle", "from 0 to the outer one");
  }
  const bool round = light.type == LightType::kSphere || light.type == LightType::kDisc;
  require(!round || is_length(light.radius), "radius", "above 0");
  require(light.type != LightType::kRectangle || std::ranges::all_of(light.size, is_length), "size",
          "above 0");
}

}  // namespace rebounce
