#include "runtime/demo/picture/camera.h"

#include <cmath>
#include <numbers>

#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

Camera look_at(const Float3& position, const Float3& target, float vertical_fov) {
  if (!(vertical_fov > 0 && vertical_fov < std::numbers::pi_v<float>)) {
    throw Error("camera: the field of view must be between 0 and 180 degrees");
  }
  const glm::vec3 away = to_glm(position) - to_glm(target);
  const float distance = glm::length(away);
  if (!(distance > 0) || std::isinf(distance)) {
    throw Error("camera: position and target must be two different points");
  }
  const glm::vec3 backward = away / distance;
  const bool upright = std::abs(backward.y) < 0.9999F;
  const glm::vec3 right =
      glm::normalize(glm::cross(upright ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1), backward));
  Camera camera;
  camera.position = position;
  camera.right = to_float3(right);
  camera.up = to_float3(glm::cross(backward, right));
  camera.backward = to_float3(backward);
  camera.vertical_fov = vertical_fov;
  return camera;
}

}  // namespace rebounce
