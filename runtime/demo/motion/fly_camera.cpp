#include "runtime/demo/motion/fly_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// Less than straight up and down, where the heading is undefined.
constexpr float kMaxElevation = 0.49F * std::numbers::pi_v<float>;

}  // namespace

FlyCamera::FlyCamera(const Camera& camera)
    : position_(to_glm(camera.position)), vertical_fov_(camera.vertical_fov) {
  const glm::vec3 forward = -to_glm(camera.backward);
  heading_ = std::atan2(-forward.x, -forward.z);
  elevation_ =
      std::clamp(std::asin(std::clamp(forward.y, -1.0F, 1.0F)), -kMaxElevation, kMaxElevation);
}

glm::vec3 FlyCamera::forward() const {
  return {-std::sin(heading_) * std::cos(elevation_), std::sin(elevation_),
          -std::cos(heading_) * std::cos(elevation_)};
}

glm::vec3 FlyCamera::right() const {
  return {std::cos(heading_), 0, -std::sin(heading_)};
}

Camera FlyCamera::camera() const {
  Camera camera;
  camera.position = to_float3(position_);
  camera.right = to_float3(right());
  camera.backward = to_float3(-forward());
  camera.up = to_float3(glm::cross(right(), forward()));
  camera.vertical_fov = vertical_fov_;
  return camera;
}

void FlyCamera::turn(float left, float up) {
  heading_ = std::remainder(heading_ + left, 2 * std::numbers::pi_v<float>);
  elevation_ = std::clamp(elevation_ + up, -kMaxElevation, kMaxElevation);
}

void FlyCamera::move(const glm::vec3& right_up_forward) {
  position_ += right_up_forward.x * right() + right_up_forward.y * glm::vec3(0, 1, 0) +
               right_up_forward.z * forward();
}

void FlyCamera::orbit(const glm::vec3& target, float left, float up) {
  const glm::vec3 way = target - position_;
  const glm::vec3 old_up = glm::cross(right(), forward());
  const glm::vec3 seen(glm::dot(way, right()), glm::dot(way, old_up), glm::dot(way, forward()));
  turn(left, up);
  const glm::vec3 new_up = glm::cross(right(), forward());
  position_ = target - (seen.x * right() + seen.y * new_up + seen.z * forward());
}

}  // namespace rebounce
