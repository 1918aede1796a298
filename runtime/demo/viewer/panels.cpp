#include "panels.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <numbers>
#include <string>

#include "controls.h"
#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr const char* kTransferName = "transfer (one product)";
constexpr const char* kHierarchicalName = "hierarchical (links)";

struct NamedShow {
  const char* name;
  Show show;
};
constexpr std::array<NamedShow, 5> kShows = {{{"all light", Show::kRadiosity},
                                              {"direct", Show::kDirect},
                                              {"indirect", Show::kIndirect},
                                              {"patches", Show::kPatches},
                                              {"error", Show::kError}}};

std::string name_of(const IndirectMethod& method) {
  if (method.on_links) return kHierarchicalName;
  if (!method.iteration) return kTransferName;
  const auto* named =
      std::ranges::find(kSolveMethods, *method.iteration, &NamedSolveMethod::method);
  return std::string(named->name);
}

void choose_method(const char* label, bool has_links, IndirectMethod& method) {
  const auto choice = [&](const std::string& name, std::optional<SolveMethod> iteration,
                          bool on_links) {
    const bool is_chosen = method.iteration == iteration && method.on_links == on_links;
    if (!ImGui::Selectable(name.c_str(), is_chosen)) return;
    method.iteration = iteration;
    method.on_links = on_links;
  };
  ImGui::PushID(label);
  ImGui::SetNextItemWidth(-70);
  if (ImGui::BeginCombo(label, name_of(method).c_str())) {
    choice(kTransferName, std::nullopt, false);
    for (const NamedSolveMethod& named : kSolveMethods) {
      choice(std::string(named.name), named.method, false);
    }
    if (has_links) choice(kHierarchicalName, std::nullopt, true);
    ImGui::EndCombo();
  }
  if (method.iterates()) {
    ImGui::SetNextItemWidth(110);
    ImGui::SliderInt("sweeps", &method.sweeps, 1, 30, "%d", ImGuiSliderFlags_AlwaysClamp);
    ImGui::SameLine();
    ImGui::Checkbox("warm", &method.warm);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("Begin with the solution of the frame before");
  }
  ImGui::PopID();
}

void time_row(const char* stage, double microseconds) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextUnformatted(stage);
  ImGui::TableNextColumn();
  ImGui::Text("%8.2f ms", microseconds / 1000);
}

void edit_type(Light& light) {
  int type = static_cast<int>(light.type);
  if (!ImGui::Combo("type", &type, "point\0spot\0directional\0")) return;
  const bool was_far = light.type == LightType::kDirectional;
  light.type = static_cast<LightType>(type);
  const bool is_far = light.type == LightType::kDirectional;
  // Candela are not lux: begin with what is bright indoors.
  if (was_far != is_far) light.intensity = is_far ? 1000 : 100;
}

void edit_direction(Light& light) {
  if (ImGui::DragFloat3("direction", light.direction.data(), 0.01F, -1, 1, "%.2f")) {
    const float length = glm::length(to_glm(light.direction));
    if (length > 1e-3F) {
      light.direction = to_float3(to_glm(light.direction) / length);
    } else {
      light.direction = {0, -1, 0};
    }
  }
}

void edit_cone(Light& light) {
  float inner = light.inner_cone_angle / kDegree, outer = light.outer_cone_angle / kDegree;
  ImGui::SliderFloat("outer cone", &outer, 1, 90, "%.0f deg", ImGuiSliderFlags_AlwaysClamp);
  ImGui::SliderFloat("inner cone", &inner, 0, outer - 0.5F, "%.0f deg",
                     ImGuiSliderFlags_AlwaysClamp);
  light.outer_cone_angle = outer * kDegree;
  light.inner_cone_angle = std::min(inner, outer - 0.5F) * kDegree;
}

// A motion around where the lamp is.
void begin_motion(ViewerLight& lamp, LightMotion::Kind kind, float size) {
  lamp.motion.kind = kind;
  lamp.motion.center = lamp.motion.from = lamp.motion.to = lamp.light.position;
  lamp.motion.radius = size;
  lamp.motion.from[0] -= size;
  lamp.motion.to[0] += size;
}

void edit_motion(ViewerLight& lamp, float step) {
  if (lamp.motion.kind == LightMotion::Kind::kKeys) {
    ImGui::TextUnformatted("moves by its light path");
    return;
  }
  int kind = static_cast<int>(lamp.motion.kind);
  if (ImGui::Combo("motion", &kind, "still\0circle\0swing\0")) {
    begin_motion(lamp, static_cast<LightMotion::Kind>(kind), 20 * step);
  }
  if (lamp.motion.kind == LightMotion::Kind::kStill) return;
  ImGui::DragFloat("period", &lamp.motion.period, 0.05F, 0.1F, 600, "%.1f s",
                   ImGuiSliderFlags_AlwaysClamp);
  if (lamp.motion.kind == LightMotion::Kind::kCircle) {
    ImGui::DragFloat3("centre", lamp.motion.center.data(), step, 0, 0, "%.2f");
    ImGui::DragFloat("radius", &lamp.motion.radius, step, 0, 1e6F, "%.2f m",
                     ImGuiSliderFlags_AlwaysClamp);
  } else {
    ImGui::DragFloat3("from", lamp.motion.from.data(), step, 0, 0, "%.2f");
    ImGui::DragFloat3("to", lamp.motion.to.data(), step, 0, 0, "%.2f");
  }
}

void edit_lamp(ViewerLight& lamp, const FlyCamera& camera, float step) {
  Light& light = lamp.light;
  ImGui::Checkbox("on", &lamp.on);
  edit_type(light);
  const bool is_far = light.type == LightType::kDirectional;
  ImGui::ColorEdit3("colour", light.color.data(), ImGuiColorEditFlags_Float);
  ImGui::DragFloat("intensity", &light.intensity, 0.01F * std::max(light.intensity, 0.1F), 0, 1e9F,
                   is_far ? "%.1f lx" : "%.1f cd",
                   ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat);
  if (!is_far && lamp.motion.kind == LightMotion::Kind::kStill) {
    ImGui::DragFloat3("position", light.position.data(), step, 0, 0, "%.2f");
  }
  if (light.type != LightType::kPoint) {
    edit_direction(light);
    if (ImGui::Button("Shine where I look")) light.direction = to_float3(camera.forward());
  }
  if (light.type == LightType::kSpot) edit_cone(light);
  if (!is_far) edit_motion(lamp, step);
}

ViewerLight lamp_ahead(const FlyCamera& camera, float size) {
  ViewerLight lamp;
  lamp.light.position = to_float3(camera.position() + 0.3F * size * camera.forward());
  lamp.light.intensity = 4 * size * size;  // some lux at the other end of the scene
  lamp.light.direction = to_float3(camera.forward());
  return lamp;
}

}  // namespace

void Panels::smooth(const StageTimes& times) {
  // The first frames fill caches and make solvers: they do not count.
  constexpr int kWarmUp = 3;
  const float part = frame_ < kWarmUp ? 1 : 0.1F;
  frame_ = std::min(frame_ + 1, kWarmUp);
  const auto blend = [part](double& old, double value) { old += part * (value - old); };
  blend(smoothed_.direct, times.direct);
  for (std::size_t k = 0; k < kSideCount; ++k) blend(smoothed_.solve[k], times.solve[k]);
  blend(smoothed_.upload, times.upload);
  blend(smoothed_.shadows, times.shadows);
  blend(smoothed_.draw, times.draw);
}

void Panels::draw(ViewerState& state, const FrameDrawer& frame) {
  smooth(frame.times());
  ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({330, std::min(760.0F, ImGui::GetIO().DisplaySize.y - 20)},
                           ImGuiCond_FirstUseEver);
  if (ImGui::Begin("Rebounce")) {
    ImGui::PushItemWidth(-80);
    draw_view(state, frame);
    draw_methods(state, frame);
    draw_times(state);
    draw_lights(state, frame);
    ImGui::PopItemWidth();
  }
  ImGui::End();
}

void Panels::draw_view(ViewerState& state, const FrameDrawer& frame) const {
  ImGui::Text("%zu patches, %s operator", frame.scene().data().patches.size(),
              std::string(frame.scene().data().transfer->kind()).c_str());
  if (!ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) return;
  for (std::size_t k = 0; k < kShows.size(); ++k) {
    if (k % 3 != 0) ImGui::SameLine(100 * static_cast<float>(k % 3));
    if (ImGui::RadioButton(kShows[k].name, state.show == kShows[k].show)) {
      state.show = kShows[k].show;
    }
  }
  ImGui::SliderFloat("exposure", &state.exposure, -16, 16, "%+.1f EV");
  if (ImGui::Button("Find exposure")) state.wants_exposure = true;
  if (state.show != Show::kError) return;
  if (!frame.scene().has_reference()) {
    ImGui::TextWrapped("There is no reference solution to compare with.");
    return;
  }
  ImGui::Text("error, area-weighted  %.2e", frame.scene().error(Side::kFirst));
  if (state.is_split) ImGui::Text("right                 %.2e", frame.scene().error(Side::kSecond));
  ImGui::Text("yellow is             %.2e", static_cast<double>(frame.error_top()));
}

void Panels::draw_methods(ViewerState& state, const FrameDrawer& frame) const {
  if (!ImGui::CollapsingHeader("Indirect light", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const bool has_links = !frame.scene().data().links.empty();
  choose_method(state.is_split ? "left" : "method", has_links, state.methods[0]);
  ImGui::Checkbox("split the screen", &state.is_split);
  if (!state.is_split) return;
  ImGui::SliderFloat("at", &state.split, 0, 1, "%.2f");
  choose_method("right", has_links, state.methods[1]);
}

void Panels::draw_times(const ViewerState& state) const {
  if (!ImGui::CollapsingHeader("Time of a frame", ImGuiTreeNodeFlags_DefaultOpen)) return;
  if (!ImGui::BeginTable("times", 2)) return;
  const StageTimes& t = smoothed_;
  time_row("direct light, patches", t.direct);
  time_row(state.is_split ? "indirect light, left" : "indirect light", t.solve[0]);
  if (state.is_split) time_row("indirect light, right", t.solve[1]);
  time_row("vertices and upload", t.upload);
  time_row("shadow maps", t.shadows);
  time_row("drawing", t.draw);
  const double solve = t.solve[0] + (state.is_split ? t.solve[1] : 0);
  time_row("all", t.direct + solve + t.upload + t.shadows + t.draw);
  ImGui::EndTable();
}

void Panels::draw_lights(ViewerState& state, const FrameDrawer& frame) const {
  if (!ImGui::CollapsingHeader("Lights", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const float size = frame.bounds().diagonal();
  ImGui::Checkbox("play motions", &state.playing);
  for (std::size_t k = 0; k < state.lights.size(); ++k) {
    ImGui::PushID(static_cast<int>(k));
    const std::string& name = state.lights[k].light.name;
    const std::string label = std::to_string(k) + (name.empty() ? "" : ": " + name);
    if (ImGui::Selectable(label.c_str(), k == state.selected)) state.selected = k;
    ImGui::PopID();
  }
  if (ImGui::Button("Add")) {
    state.lights.push_back(lamp_ahead(state.camera, size));
    state.selected = state.lights.size() - 1;
  }
  if (state.selected < state.lights.size()) {
    ImGui::SameLine();
    const bool remove = ImGui::Button("Remove");
    ImGui::Separator();
    edit_lamp(state.lights[state.selected], state.camera, 0.005F * size);
    if (remove) {
      state.lights.erase(state.lights.begin() + static_cast<std::ptrdiff_t>(state.selected));
    }
  }
  ImGui::Separator();
  ImGui::ColorEdit3("sky", state.sky.color.data(), ImGuiColorEditFlags_Float);
  ImGui::DragFloat("luminance", &state.sky.luminance, 0.01F * std::max(state.sky.luminance, 1.0F),
                   0, 1e6F, "%.1f cd/m2", ImGuiSliderFlags_AlwaysClamp);
}

}  // namespace rebounce
