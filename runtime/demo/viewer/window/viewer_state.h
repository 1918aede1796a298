#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "rebounce/sky.h"
#include "runtime/demo/motion/fly_camera.h"
#include "runtime/demo/viewer/window/viewer_setup.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {

/// The state that the user controls.
struct ViewerState {
  explicit ViewerState(const ViewerSetup& setup)
      : lights(setup.lights),
        spheres(setup.spheres),
        sky(setup.sky),
        camera(setup.camera),
        show(setup.show),
        methods(setup.methods),
        split(setup.split.value_or(0.5F)),
        is_split(setup.split.has_value()) {}

  /// The lamps that are on, at the current time.
  std::vector<Light> lights_now() const {
    std::vector<Light> now;
    for (const ViewerLight& light : lights) {
      if (light.on) now.push_back(moved(light.light, light.motion, time));
    }
    return now;
  }

  /// Those of the sides of the screen that are shown.
  std::span<const IndirectMethod> shown_methods() const {
    return std::span(methods).first(is_split ? methods.size() : 1);
  }

  /// The shown spheres, at the current time.
  std::vector<ViewerSphere> spheres_now() const {
    std::vector<ViewerSphere> now;
    for (const ViewerSphere& sphere : spheres) {
      if (!sphere.on || !shows_spheres) continue;
      now.push_back(sphere);
      now.back().position = moved(sphere.position, sphere.motion, time);
    }
    return now;
  }

  /// Adds a point lamp that suits a scene of `size` metres, aimed along `direction`, and selects
  /// it.
  void add_lamp(const glm::vec3& position, const glm::vec3& direction, float size) {
    ViewerLight lamp;
    lamp.light.position = to_float3(position);
    lamp.light.direction = to_float3(direction);
    lamp.light.intensity = 4 * size * size;  // some lux at the other end of the scene
    lights.push_back(lamp);
    selected = lights.size() - 1;
  }

  /// Adds 64 coloured points that circle all over the box from `low` to `high`.
  void add_many_lamps(const glm::vec3& low, const glm::vec3& high) {
    constexpr int kAcross = 4, kCount = kAcross * kAcross * kAcross;
    const glm::vec3 size = high - low;
    for (int k = 0; k < kCount; ++k) {
      const glm::vec3 cell(k % kAcross, k / kAcross % kAcross, k / kAcross / kAcross);
      const glm::vec3 place = low + size * (cell + 0.5F) / static_cast<float>(kAcross);
      add_lamp(place, {0, -1, 0}, glm::length(size) / std::sqrt(static_cast<float>(kCount)));
      ViewerLight& lamp = lights.back();
      for (std::size_t c = 0; c < 3; ++c) {
        lamp.light.color[c] =
            0.5F + 0.5F * std::cos(2.4F * static_cast<float>(k) + 2.1F * static_cast<float>(c));
      }
      lamp.motion.kind = LightMotion::Kind::kCircle;
      lamp.motion.center = to_float3(place);
      lamp.motion.radius = 0.1F * std::min(size.x, size.z);
      lamp.motion.period = 4 + static_cast<float>(k % 5);
    }
  }

  /// Adds a sphere that suits a scene of `size` metres, and selects it.
  void add_sphere(const glm::vec3& position, float size) {
    spheres.push_back({.position = to_float3(position), .radius = kSpherePart * size});
    selected_sphere = spheres.size() - 1;
    shows_spheres = true;
  }

  /// The selected lamp, or sphere, stays selected if it is another.
  void remove_lamp(std::size_t k) {
    lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(k));
    if (k < selected) --selected;
  }
  void remove_sphere(std::size_t k) {
    spheres.erase(spheres.begin() + static_cast<std::ptrdiff_t>(k));
    if (k < selected_sphere) --selected_sphere;
  }

  static constexpr float kSpherePart = 0.03F;  ///< radius of an added sphere, part of the size

  std::vector<ViewerLight> lights;
  std::vector<ViewerSphere> spheres;
  Sky sky;
  FlyCamera camera;
  Show show;
  float exposure = 0;
  std::array<IndirectMethod, 2> methods;
  float split;
  bool is_split;
  float time = 0;  ///< seconds
  bool playing = true;
  bool draws_emitter_lamps = true;  ///< LitScene::emitter_lamps
  bool wants_exposure = false;      ///< compute the exposure again
  bool shows_panels = true;
  bool shows_spheres = true;
  std::size_t selected = 0;  ///< selected lamp
  std::size_t selected_sphere = 0;
};

}  // namespace rebounce
