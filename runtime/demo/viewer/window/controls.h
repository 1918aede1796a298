#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "runtime/demo/viewer/gl/scene_renderer.h"
#include "runtime/demo/viewer/window/lit_scene.h"
#include "runtime/demo/viewer/window/viewer_state.h"

namespace rebounce {

/// Mouse and keys outside the panels: steers the camera, drags, adds and removes spheres and lamps,
/// and draws handles for lamps over the picture. Uses ImGui's input of the current frame.
class Controls {
 public:
  Controls(const LitScene& scene, const SceneBounds& bounds) : scene_(scene), bounds_(bounds) {}

  void update(ViewerState& state);

  /// Draws the menu of the place that the right button was clicked on, while it is open.
  void draw_menu(ViewerState& state) const;

  /// Draws a disc in its colour for each lamp that has a position; hollow if it is off.
  void draw_handles(const ViewerState& state) const;

 private:
  void steer(ViewerState& state);
  void fly(ViewerState& state) const;
  void press_keys(ViewerState& state) const;
  void drag_lamp(ViewerState& state) const;
  void drag_sphere(ViewerState& state) const;
  void take_hold(ViewerState& state);
  void open_menu(const ViewerState& state);
  std::optional<std::size_t> lamp_under_mouse(const ViewerState& state) const;
  std::optional<std::size_t> sphere_under_mouse(const ViewerState& state) const;
  float distance_along(const glm::vec3& origin, const glm::vec3& direction) const;

  const LitScene& scene_;
  const SceneBounds& bounds_;
  /// Where the menu was opened.
  struct Clicked {
    std::optional<std::size_t> lamp, sphere;
    glm::vec3 eye{0}, direction{0};
    float distance = 0;  // metres to the surface
  };

  bool dragging_lamp_ = false, dragging_sphere_ = false, turning_ = false, orbiting_ = false;
  glm::vec3 orbit_target_{0};
  Clicked clicked_;
};

/// Moves a lamp and its motion by `shift` metres.
void shift_lamp(ViewerLight& lamp, const glm::vec3& shift);

/// Moves a sphere and its motion by `shift` metres.
void shift_sphere(ViewerSphere& sphere, const glm::vec3& shift);

}  // namespace rebounce
