#pragma once

// Conversions between the plain arrays of the public headers and GLM's vectors.

#include <glm/glm.hpp>

#include "rebounce/types.h"

namespace rebounce {

inline glm::vec2 to_glm(const Float2& v) {
  return {v[0], v[1]};
}
inline glm::vec3 to_glm(const Float3& v) {
  return {v[0], v[1], v[2]};
}
inline glm::dvec3 to_dvec3(const Float3& v) {
  return {v[0], v[1], v[2]};
}
inline Float3 to_float3(const glm::vec3& v) {
  return {v.x, v.y, v.z};
}
inline Float3 to_float3(const glm::dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace rebounce
