#pragma once

// A room with boxes of any orientation in it, whose walls and faces are cut into patches.

#include <random>

#include "runtime/rays/float3_glm.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test {

/// A parallelogram from `corner` along `x` and `y`, cut into steps² x 2 patches; its front is where
/// they turn counter-clockwise.
inline void add_parallelogram(TransferData& data, const glm::vec3& corner, const glm::vec3& x,
                              const glm::vec3& y, int steps) {
  const auto at = [&](int i, int j) {
    return corner +
           (x * static_cast<float>(i) + y * static_cast<float>(j)) / static_cast<float>(steps);
  };
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      add_patch(data, at(i, j), at(i + 1, j), at(i + 1, j + 1), {0.5F, 0.5F, 0.5F});
      add_patch(data, at(i, j), at(i + 1, j + 1), at(i, j + 1), {0.5F, 0.5F, 0.5F});
    }
  }
}

/// The faces of a box around `middle` with half its sides; fronts outside, or inside.
inline void add_slanted_box(TransferData& data, const glm::vec3& middle,
                            const std::array<glm::vec3, 3>& half, bool inwards, int steps) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const glm::vec3 x = half[(axis + 1) % 3], y = half[(axis + 2) % 3];
    for (const float side : {-1.0F, 1.0F}) {
      const glm::vec3 corner = middle + side * half[axis] - x - y;
      const bool turned = (glm::dot(glm::cross(x, y), side * half[axis]) > 0) == inwards;
      add_parallelogram(data, corner, turned ? 2.0F * y : 2.0F * x, turned ? 2.0F * x : 2.0F * y,
                        steps);
    }
  }
}

/// A room of 4 x 3 x 4 m around the origin with `count` boxes in it. Each wall has steps² x 2
/// patches.
inline TransferData furnished_box(std::mt19937& engine, int count, int steps = 16) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  TransferData data;
  add_slanted_box(data, {0, 0, 0}, {glm::vec3(2, 0, 0), {0, 1.5F, 0}, {0, 0, 2}}, true, steps);
  for (int k = 0; k < count; ++k) {
    const glm::vec3 x = glm::normalize(any()), z = glm::normalize(glm::cross(x, any()));
    const glm::vec3 size = 0.05F + 0.25F * glm::abs(any());
    const glm::vec3 middle = any() * glm::vec3(1.4F, 0.9F, 1.4F);
    add_slanted_box(data, middle, {size.x * x, size.y * glm::cross(z, x), size.z * z}, false, 3);
  }
  return data;
}

/// A lamp of any direction in the middle part of that room.
inline Light lamp_in_box(std::mt19937& engine, LightType type) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  Light light;
  light.type = type;
  light.position = to_float3(any() * glm::vec3(1.8F, 1.3F, 1.8F));
  light.direction = to_float3(glm::normalize(any()));
  light.tangent = to_float3(glm::cross(to_glm(light.direction), any()));
  light.outer_cone_angle = 1;
  light.inner_cone_angle = 0.5F;
  light.radius = 0.1F;
  light.size = {0.3F, 0.1F};
  return light;
}

}  // namespace rebounce::test
