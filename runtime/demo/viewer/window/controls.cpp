
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/demo/image/srgb.h"
#include "runtime/demo/viewer/window/controls.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kHandleRadius = 9;  // pixels
constexpr float kTurnPerPixel = 0.004F;
constexpr float kCrossingSeconds = 6;  // to fly along the scene's diagonal
constexpr float kHurry = 4;            // speed factor with Shift
constexpr float kLampWay = 0.85F;      // of the way to the surface, for a lamp that is added there
constexpr const char* kMenu = "menu of a place";

glm::vec2 screen_size() {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  return {size.x, size.y};
}

// Whether the right button has left the place that it was pressed at.
bool was_dragged() {
  const ImVec2 way = ImGui::GetMouseDragDelta(ImGuiMouseButton_Right);
  return way.x != 0 || way.y != 0;
}

bool has_place(const Light& light) {
  return lamp_kind(light.type).has_place();
}

// The metres per pixel at `depth` metres.
float metres_per_pixel(const Camera& camera, float depth) {
  return 2 * depth * std::tan(0.5F * camera.vertical_fov) / std::max(1.0F, screen_size().y);
}

float depth_of(const Camera& camera, const glm::vec3& point) {
  return glm::dot(to_glm(camera.position) - point, to_glm(camera.backward));
}

// The screen position of a point; nothing if it is behind the camera.
std::optional<glm::vec2> to_screen(const Camera& camera, const glm::vec3& point) {
  const float depth = depth_of(camera, point);
  if (depth <= 0) return std::nullopt;
  const glm::vec3 way = point - to_glm(camera.position);
  const float scale = 1 / metres_per_pixel(camera, depth);
  return 0.5F * screen_size() +
         scale * glm::vec2(glm::dot(way, to_glm(camera.right)), -glm::dot(way, to_glm(camera.up)));
}

ImU32 handle_color(const Float3& color) {
  const float peak = std::max({color[0], color[1], color[2], 1e-6F});
  const glm::vec3 shown = to_glm(color) / peak;
  return ImGui::ColorConvertFloat4ToU32(
      {linear_to_srgb(shown.r), linear_to_srgb(shown.g), linear_to_srgb(shown.b), 1});
}

Light light_now(const ViewerState& state, const ViewerLight& lamp) {
  return moved(lamp.light, lamp.motion, state.time);
}

bool shines_one_way(const Light& light) {
  return has_place(light) && lamp_kind(light.type).uses(kDirection);
}

void shift_all(Float3& position, LightMotion& motion, const glm::vec3& shift) {
  const auto move = [&](Float3& point) { point = to_float3(to_glm(point) + shift); };
  move(position);
  move(motion.center);
  move(motion.from);
  move(motion.to);
  for (LightMotion::Key& key : motion.keys) move(key.position);
}

// The unit direction from the eye through the mouse.
glm::vec3 way_to_mouse(const Camera& camera) {
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const glm::vec2 off =
      (glm::vec2(mouse.x, mouse.y) - 0.5F * screen_size()) * metres_per_pixel(camera, 1);
  return glm::normalize(off.x * to_glm(camera.right) - off.y * to_glm(camera.up) -
                        to_glm(camera.backward));
}

// The mouse's movement of an object at `place`, metres: in the plane of the view, or with Shift
// along the view.
glm::vec3 dragged(const Camera& camera, const Float3& place) {
  const ImGuiIO& io = ImGui::GetIO();
  const float metres = metres_per_pixel(camera, depth_of(camera, to_glm(place)));
  const glm::vec3 upwards = io.KeyShift ? -to_glm(camera.backward) : to_glm(camera.up);
  return metres * (io.MouseDelta.x * to_glm(camera.right) - io.MouseDelta.y * upwards);
}

// Metres along the unit `direction` from `eye` to a sphere; infinite if it misses.
float distance_to(const ViewerSphere& sphere, const glm::vec3& eye, const glm::vec3& direction) {
  const glm::vec3 to_center = to_glm(sphere.position) - eye;
  const float along = glm::dot(to_center, direction);
  const float half = sphere.radius * sphere.radius + along * along - glm::dot(to_center, to_center);
  if (half < 0 || along <= 0) return std::numeric_limits<float>::infinity();
  return along - std::sqrt(half);
}

}  // namespace

void shift_lamp(ViewerLight& lamp, const glm::vec3& shift) {
  shift_all(lamp.light.position, lamp.motion, shift);
}

void shift_sphere(ViewerSphere& sphere, const glm::vec3& shift) {
  shift_all(sphere.position, sphere.motion, shift);
}

void Controls::update(ViewerState& state) {
  if (!ImGui::GetIO().WantCaptureKeyboard) {
    press_keys(state);
    fly(state);
  }
  steer(state);
}

void Controls::press_keys(ViewerState& state) const {
  static constexpr std::array kShown = {Show::kRadiosity, Show::kDirect, Show::kIndirect,
                                        Show::kPatches, Show::kError};
  for (int k = 0; k < static_cast<int>(kShown.size()); ++k) {
    if (ImGui::IsKeyPressed(GLFW_KEY_1 + k, false))
      state.show = kShown[static_cast<std::size_t>(k)];
  }
  if (ImGui::IsKeyPressed(GLFW_KEY_SPACE, false)) state.playing = !state.playing;
  if (ImGui::IsKeyPressed(GLFW_KEY_TAB, false)) state.shows_panels = !state.shows_panels;
  if (ImGui::IsKeyPressed(GLFW_KEY_F, false)) state.is_split = !state.is_split;
  if (ImGui::IsKeyPressed(GLFW_KEY_B, false)) state.shows_spheres = !state.shows_spheres;
  if (ImGui::IsKeyPressed(GLFW_KEY_X, false)) state.wants_exposure = true;
}

void Controls::fly(ViewerState& state) const {
  const auto axis = [](int forth, int back) {
    return static_cast<float>(ImGui::IsKeyDown(forth)) - static_cast<float>(ImGui::IsKeyDown(back));
  };
  const glm::vec3 way(axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q),
                      axis(GLFW_KEY_W, GLFW_KEY_S));
  const ImGuiIO& io = ImGui::GetIO();
  const float speed = bounds_.diagonal() / kCrossingSeconds * (io.KeyShift ? kHurry : 1);
  state.camera.move(way * (speed * io.DeltaTime));
}

std::optional<std::size_t> Controls::lamp_under_mouse(const ViewerState& state) const {
  if (!state.shows_panels) return std::nullopt;  // discs are hidden
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  std::optional<std::size_t> nearest;
  float least = 2 * kHandleRadius;
  for (std::size_t k = 0; k < state.lights.size(); ++k) {
    const Light light = light_now(state, state.lights[k]);
    if (!has_place(light)) continue;
    const auto at = to_screen(state.camera.camera(), to_glm(light.position));
    if (!at) continue;
    const float distance = glm::distance(*at, glm::vec2(mouse.x, mouse.y));
    if (distance > least) continue;
    least = distance;
    nearest = k;
  }
  return nearest;
}

float Controls::distance_along(const glm::vec3& origin, const glm::vec3& direction) const {
  const std::array ray = {Ray{.origin = to_float3(origin),
                              .t_near = 0,
                              .direction = to_float3(direction),
                              .t_far = std::numeric_limits<float>::infinity()}};
  std::array<Hit, 1> hit;
  scene_.engine().parts().tracer->intersect(ray, hit);
  return hit[0].triangle == kNone ? 0.5F * bounds_.diagonal() : hit[0].t;
}

std::optional<std::size_t> Controls::sphere_under_mouse(const ViewerState& state) const {
  const Camera camera = state.camera.camera();
  const glm::vec3 eye = to_glm(camera.position), direction = way_to_mouse(camera);
  std::optional<std::size_t> nearest;
  float least = distance_along(eye, direction);
  for (std::size_t k = 0; k < state.spheres.size(); ++k) {
    ViewerSphere sphere = state.spheres[k];
    if (!sphere.on || !state.shows_spheres) continue;
    sphere.position = moved(sphere.position, sphere.motion, state.time);
    const float distance = distance_to(sphere, eye, direction);
    if (distance >= least) continue;
    least = distance;
    nearest = k;
  }
  return nearest;
}

void Controls::drag_lamp(ViewerState& state) const {
  ViewerLight& lamp = state.lights[state.selected];
  shift_lamp(lamp, dragged(state.camera.camera(), light_now(state, lamp).position));
}

void Controls::drag_sphere(ViewerState& state) const {
  ViewerSphere& sphere = state.spheres[state.selected_sphere];
  shift_sphere(sphere,
               dragged(state.camera.camera(), moved(sphere.position, sphere.motion, state.time)));
}

void Controls::take_hold(ViewerState& state) {
  const auto lamp = lamp_under_mouse(state);
  const auto sphere = lamp ? std::nullopt : sphere_under_mouse(state);
  dragging_lamp_ = lamp.has_value();
  dragging_sphere_ = sphere.has_value();
  turning_ = !dragging_lamp_ && !dragging_sphere_;
  if (lamp) state.selected = *lamp;
  if (sphere) state.selected_sphere = *sphere;
}

void Controls::open_menu(const ViewerState& state) {
  const Camera camera = state.camera.camera();
  clicked_ = {};
  clicked_.lamp = lamp_under_mouse(state);
  clicked_.eye = to_glm(camera.position);
  clicked_.direction = way_to_mouse(camera);
  if (!clicked_.lamp) clicked_.sphere = sphere_under_mouse(state);
  clicked_.distance = distance_along(clicked_.eye, clicked_.direction);
  ImGui::OpenPopup(kMenu);
}

void Controls::draw_menu(ViewerState& state) const {
  if (!ImGui::BeginPopup(kMenu)) return;
  const auto& [lamp, sphere, eye, direction, distance] = clicked_;
  const float size = bounds_.diagonal();
  if (lamp && *lamp < state.lights.size()) {
    ViewerLight& chosen = state.lights[*lamp];
    if (ImGui::MenuItem("Remove this lamp")) {
      state.remove_lamp(*lamp);
    } else if (ImGui::MenuItem(chosen.on ? "Switch it off" : "Switch it on")) {
      chosen.on = !chosen.on;
    }
  } else if (sphere && *sphere < state.spheres.size()) {
    if (ImGui::MenuItem("Remove this sphere")) state.remove_sphere(*sphere);
  } else {
    // In front of the surface, so that it lights it.
    if (ImGui::MenuItem("Add a lamp here")) {
      state.add_lamp(eye + kLampWay * distance * direction, direction, size);
    }
    if (ImGui::MenuItem("Add a sphere here")) {
      const float gap = 2 * ViewerState::kSpherePart * size;
      state.add_sphere(eye + std::max(distance - gap, 0.5F * distance) * direction, size);
    }
  }
  ImGui::EndPopup();
}

void Controls::steer(ViewerState& state) {
  const ImGuiIO& io = ImGui::GetIO();
  if (!io.WantCaptureMouse) {
    if (ImGui::IsMouseReleased(ImGuiMouseButton_Right) && orbiting_ && !was_dragged()) {
      open_menu(state);
    }
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) take_hold(state);
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Right)) {
      orbiting_ = true;
      orbit_target_ =
          state.camera.position() +
          distance_along(state.camera.position(), state.camera.forward()) * state.camera.forward();
    }
    if (io.MouseWheel != 0) {
      state.camera.move({0, 0, 0.05F * io.MouseWheel * bounds_.diagonal()});
    }
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
    dragging_lamp_ = dragging_sphere_ = turning_ = false;
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Right)) orbiting_ = false;
  const float left = kTurnPerPixel * io.MouseDelta.x, up = kTurnPerPixel * io.MouseDelta.y;
  if (dragging_lamp_ && state.selected < state.lights.size()) drag_lamp(state);
  if (dragging_sphere_ && state.selected_sphere < state.spheres.size()) drag_sphere(state);
  if (turning_) state.camera.turn(left, up);
  if (orbiting_) state.camera.orbit(orbit_target_, -left, -up);
}

void Controls::draw_handles(const ViewerState& state) const {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const Camera camera = state.camera.camera();
  for (std::size_t k = 0; k < state.lights.size(); ++k) {
    const Light light = light_now(state, state.lights[k]);
    const auto at = has_place(light) ? to_screen(camera, to_glm(light.position)) : std::nullopt;
    if (!at) continue;
    const ImVec2 place(at->x, at->y);
    const bool selected = k == state.selected;
    if (state.lights[k].on) list->AddCircleFilled(place, kHandleRadius, handle_color(light.color));
    list->AddCircle(place, kHandleRadius, IM_COL32(20, 20, 20, 255), 0, 3);
    list->AddCircle(place, kHandleRadius + 1,
                    selected ? IM_COL32(255, 170, 40, 255) : IM_COL32(240, 240, 240, 255), 0, 2);
    if (!shines_one_way(light)) continue;
    const glm::vec3 tip =
        to_glm(light.position) + 0.08F * bounds_.diagonal() * to_glm(light.direction);
    if (const auto end = to_screen(camera, tip)) {
      list->AddLine(place, {end->x, end->y}, IM_COL32(240, 240, 240, 255), 2);
    }
  }
}

}  // namespace rebounce
