#include "runtime/lights/lamp_shadows.h"

#include <algorithm>

#include "runtime/lights/light_sampling.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

void LampShadows::add_surface(const PreparedLight& lamp, const LitPoint& point,
                              std::span<const glm::vec2> places, float weight, std::size_t sum) {
  const float unoccluded = lamp.unoccluded_irradiance(point.position, point.normal);
  if (unoccluded <= 0) return;
  std::array<UnitLight, kMaxAreaLightSamples> sample;
  std::array<float, kMaxAreaLightSamples> part;
  lamp.evaluate_places(point.position, places, std::span(sample).first(places.size()));
  float whole = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    part[k] = sample[k].illuminance * std::max(0.0F, glm::dot(sample[k].direction, point.normal));
    whole += part[k];
  }
  if (whole <= 0) {  // the lamp is below the horizon, except for a sliver
    const glm::vec3 path = lamp.highest_point(point.normal) - point.position;
    const float distance = glm::length(path);
    add_ray(point.position, {path / distance, distance, 0}, weight * unoccluded, sum);
    return;
  }
  const float scale = weight * unoccluded / whole;
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (part[k] > 0) add_ray(point.position, sample[k], scale * part[k], sum);
  }
}

void LampShadows::add_ray(const glm::vec3& position, const UnitLight& light, float irradiance,
                          std::size_t sum) {
  if (count_ == kBatch) flush();
  Ray& ray = rays_[count_];
  ray.origin = to_float3(position);
  ray.t_near = 0;
  ray.direction = to_float3(light.direction);
  ray.time = 0;
  ray.t_far = shadow_ray_length(light.distance);
  ray.mask = 0xFFFFFFFFU;
  ray.id = 0;
  ray.flags = 0;
  sum_[count_] = static_cast<std::uint32_t>(sum);
  carried_[count_++] = irradiance;
}

void LampShadows::flush() {
  // Holes in a map are finer than patches, so means are enough.
  tracer_.transmittance({rays_.data(), count_}, PassageDetail::kTriangle,
                        {transmitted_.data(), count_});
  for (std::size_t k = 0; k < count_; ++k) irradiance_[sum_[k]] += transmitted_[k] * carried_[k];
  count_ = 0;
}

}  // namespace rebounce
