#pragma once

#include <glm/glm.hpp>

#include "rebounce/scene_data.h"

namespace rebounce {

/// A camera for the user to steer; it stays level.
class FlyCamera {
 public:
  /// Starts like `camera`, but level.
  explicit FlyCamera(const Camera& camera);

  Camera camera() const;
  glm::vec3 forward() const;
  const glm::vec3& position() const { return position_; }

  /// Turns on the spot, by radians to the left and upwards.
  void turn(float left, float up);

  /// Moves by metres to its right, upwards in the world, and forwards.
  void move(const glm::vec3& right_up_forward);

  /// Turns around `target`, which stays fixed in the picture.
  void orbit(const glm::vec3& target, float left, float up);

 private:
  glm::vec3 right() const;

  glm::vec3 position_;
  float heading_;    // radians; 0 looks along -Z, positive to the left
  float elevation_;  // radians
  float vertical_fov_;
};

}  // namespace rebounce
