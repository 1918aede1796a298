#include "runtime/lights/prepared_light.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

PreparedLight::PreparedLight(const Light& light)
    : kind(&lamp_kind(light.type)), reach_squared(std::numeric_limits<float>::infinity()) {
  if (kind->has_place()) {
    position = to_glm(light.position);
    range = light.range;
    if (range > 0) reach_squared = range * range;
  }
  kind->prepare(light, *this);
}

bool PreparedLight::has_area() const {
  return kind->surface != nullptr;
}

UnitLight PreparedLight::evaluate(const glm::vec3& point) const {
  return kind->evaluate(*this, point);
}

void PreparedLight::evaluate_places(const glm::vec3& point, std::span<const glm::vec2> places,
                                    std::span<UnitLight> light) const {
  kind->surface->evaluate_places(*this, point, places, light);
}

float PreparedLight::unoccluded_irradiance(const glm::vec3& point, const glm::vec3& normal) const {
  const glm::vec3 to_center = position - point;
  const float window = range_window(glm::dot(to_center, to_center));
  if (window <= 0) return 0;
  return window * std::numbers::pi_v<float> * kind->surface->form_factor(*this, point, normal);
}

glm::vec3 PreparedLight::highest_point(const glm::vec3& normal) const {
  return kind->surface->highest_point(*this, normal);
}

// KHR_lights_punctual, "Range Property".
float PreparedLight::range_window(float distance_squared) const {
  if (range <= 0) return 1;
  const float ratio_squared = distance_squared / reach_squared;
  return std::clamp(1 - ratio_squared * ratio_squared, 0.0F, 1.0F);
}

}  // namespace rebounce
