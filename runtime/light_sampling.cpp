// Fall-off, range window and cone of KHR_lights_punctual (Khronos glTF 2.0 extension, sections
// "Range Property", "Inner and Outer Cone Angles").

#include "rebounce/runtime/light_sampling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

float range_window(float distance, float range) {
  if (range <= 0) return 1;
  const float ratio = distance / range;
  return std::clamp(1 - ratio * ratio * ratio * ratio, 0.0F, 1.0F);
}

// `cosine`: between the cone's axis and the way from the lamp to the point.
float cone_attenuation(const Light& light, float cosine) {
  const float cos_inner = std::cos(light.inner_cone_angle);
  const float cos_outer = std::cos(light.outer_cone_angle);
  const float scale = 1 / std::max(0.001F, cos_inner - cos_outer);
  const float linear = std::clamp((cosine - cos_outer) * scale, 0.0F, 1.0F);
  return linear * linear;
}

}  // namespace

IncidentLight evaluate_light(const Light& light, const Float3& point) {
  const glm::vec3 full = to_glm(light.color) * light.intensity;
  if (light.type == LightType::kDirectional) {
    return {.direction = to_float3(-to_glm(light.direction)),
            .distance = std::numeric_limits<float>::infinity(),
            .illuminance = to_float3(full)};
  }
  const glm::vec3 to_lamp = to_glm(light.position) - to_glm(point);
  const float distance = glm::length(to_lamp);
  // A point inside the lamp has no direction to it: it receives nothing.
  if (!(distance > 0)) return {};
  const glm::vec3 direction = to_lamp / distance;
  float attenuation = range_window(distance, light.range) / (distance * distance);
  if (light.type == LightType::kSpot) {
    attenuation *= cone_attenuation(light, glm::dot(-direction, to_glm(light.direction)));
  }
  return {.direction = to_float3(direction),
          .distance = distance,
          .illuminance = to_float3(full * attenuation)};
}

}  // namespace rebounce
