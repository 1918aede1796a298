#include "precompute/patches/elements.h"

#include "runtime/rays/float3_glm.h"

namespace rebounce {

void Elements::resize(std::size_t count) {
  triangle.resize(count);
  corner.resize(count);
  normal.resize(count);
  area.resize(count);
  reflectance.resize(count);
  emits.resize(count);
  covered.resize(count);
  lamp_light.resize(count);
  density_weight.resize(count, 1.0F);
}

Float3 Elements::centroid(std::size_t e) const {
  const auto& [a, b, c] = corner[e];
  return to_float3((to_dvec3(position[a]) + to_dvec3(position[b]) + to_dvec3(position[c])) / 3.0);
}

glm::vec3 Elements::low(std::size_t e) const {
  const auto& [a, b, c] = corner[e];
  return glm::min(to_glm(position[a]), glm::min(to_glm(position[b]), to_glm(position[c])));
}

glm::vec3 Elements::high(std::size_t e) const {
  const auto& [a, b, c] = corner[e];
  return glm::max(to_glm(position[a]), glm::max(to_glm(position[b]), to_glm(position[c])));
}

}  // namespace rebounce
