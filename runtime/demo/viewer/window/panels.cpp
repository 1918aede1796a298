#include "runtime/demo/viewer/window/panels.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <numbers>
#include <string>

#include "runtime/demo/bake/punctual_light.h"
#include "runtime/demo/viewer/window/controls.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr float kStepPart = 0.005F;  // fraction of the scene's size per pixel of dragging
constexpr const char* kTransferName = "transfer (one product)";
constexpr const char* kHierarchicalName = "hierarchical (links)";
constexpr const char* kCardName = "transfer on the graphics card";

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
  if (method.on_card) return kCardName;
  if (method.on_links) return kHierarchicalName;
  if (!method.iteration) return kTransferName;
  const auto* named =
      std::ranges::find(kSolveMethods, *method.iteration, &NamedSolveMethod::method);
  return std::string(named->name);
}

/// Offers the methods that `data` and the graphics card allow.
void choose_method(const char* label, const TransferData& data, bool has_card,
                   IndirectMethod& method) {
  const auto choice = [&](const std::string& name, std::optional<SolveMethod> iteration,
                          bool on_links, bool on_card = false) {
    const bool is_chosen =
        method.iteration == iteration && method.on_links == on_links && method.on_card == on_card;
    if (!ImGui::Selectable(name.c_str(), is_chosen)) return;
    method.iteration = iteration;
    method.on_links = on_links;
    method.on_card = on_card;
  };
  ImGui::PushID(label);
  ImGui::SetNextItemWidth(-70);
  if (ImGui::BeginCombo(label, name_of(method).c_str())) {
    choice(kTransferName, std::nullopt, false);
    if (has_card) choice(kCardName, std::nullopt, false, true);
    const bool serves_all = data.transfer->roles().all_are_both();
    for (const NamedSolveMethod& named : kSolveMethods) {
      if (!has_form_factors(data) || (needs_operator(named.method) && !serves_all)) continue;
      choice(std::string(named.name), named.method, false);
    }
    if (!data.links.empty()) choice(kHierarchicalName, std::nullopt, true);
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

// Candela of a lamp with intensity 1, straight ahead.
float candela_of_unit(const Light& light) {
  const LampSurface* const surface = lamp_kind(light.type).surface;
  return surface != nullptr ? surface->candela(PreparedLight(light)) : 1;
}

// Sets unset lengths of the kind to values that suit a scene of `size` metres.
void complete_lengths(Light& light, float size) {
  for (const LampField* field : lamp_kind(light.type).fields) {
    if (field->rule != FieldRule::kLength) continue;
    const std::span<float> values = field->values(light);
    float length = (values.size() == 1 ? 0.02F : 0.06F) * size;
    for (float& value : values) {
      if (value <= 0) value = length;
      length *= 2.0F / 3;
    }
  }
}

// `size`: that of the scene, metres.
void edit_type(Light& light, float size) {
  LightType type = light.type;
  if (!ImGui::BeginCombo("type", std::string(lamp_kind(type).name).c_str())) return;
  for (const LampKind* kind : lamp_kinds()) {
    if (ImGui::Selectable(std::string(kind->name).c_str(), kind->type == type)) type = kind->type;
  }
  ImGui::EndCombo();
  if (type != light.type) change_type(light, type, size);
}

// Edits keep values within what a frame takes.
void edit_color(const char* label, Float3& color) {
  constexpr float kBrightest = 1e6F;
  if (!ImGui::ColorEdit3(label, color.data(), ImGuiColorEditFlags_Float)) return;
  for (float& part : color) part = std::clamp(part, 0.0F, kBrightest);
}

void edit_place(const char* label, Float3& place, float step) {
  constexpr float kFarthest = 1e9F;  // metres; its square is finite
  ImGui::DragFloat3(label, place.data(), step, -kFarthest, kFarthest, "%.2f",
                    ImGuiSliderFlags_AlwaysClamp);
}

bool edit_vector(const LampField& field, Light& light) {
  return ImGui::DragFloat3(field.label, field.values(light).data(), 0.01F, -1, 1, "%.2f",
                           ImGuiSliderFlags_AlwaysClamp);
}

void edit_unit_vector(const LampField& field, Light& light) {
  if (!edit_vector(field, light)) return;
  const std::span<float> v = field.values(light);
  const glm::vec3 given(v[0], v[1], v[2]);
  const float length = glm::length(given);
  std::ranges::copy(length > 1e-3F ? to_float3(given / length) : Float3{0, -1, 0}, v.begin());
}

void edit_shape(Light& light, float step) {
  constexpr float kSmallest = 1e-3F, kLargest = 1e4F;
  for (const LampField* field : lamp_kind(light.type).fields) {
    const std::span<float> values = field->values(light);
    if (field->rule == FieldRule::kLength) {
      ImGui::DragScalarN(field->label, ImGuiDataType_Float, values.data(),
                         static_cast<int>(values.size()), step, &kSmallest, &kLargest, "%.2f m",
                         ImGuiSliderFlags_AlwaysClamp);
    } else if (field->rule == FieldRule::kAcross) {
      edit_vector(*field, light);
    } else if (field->rule == FieldRule::kUnitVector && field != &kDirection) {
      edit_unit_vector(*field, light);
    }
  }
}

// A rectangle's first side must not be parallel to its direction.
void keep_first_side_across(Light& light) {
  const glm::vec3 direction = to_glm(light.direction), tangent = to_glm(light.tangent);
  if (glm::length(glm::cross(direction, tangent)) > 1e-2F * glm::length(tangent)) return;
  light.tangent = std::abs(direction.x) < 0.9F ? Float3{1, 0, 0} : Float3{0, 0, 1};
}

void edit_cone(Light& light) {
  float inner = light.inner_cone_angle / kDegree, outer = light.outer_cone_angle / kDegree;
  bool changed =
      ImGui::SliderFloat("outer cone", &outer, 1, 90, "%.0f deg", ImGuiSliderFlags_AlwaysClamp);
  const float most = std::max(outer - 0.5F, 0.0F);
  changed |=
      ImGui::SliderFloat("inner cone", &inner, 0, most, "%.0f deg", ImGuiSliderFlags_AlwaysClamp);
  if (!changed) return;
  light.outer_cone_angle = outer * kDegree;
  light.inner_cone_angle = std::min(inner, most) * kDegree;
}

// Starts a motion around a position.
void begin_motion(const Float3& position, LightMotion::Kind kind, float size, LightMotion& motion) {
  motion.kind = kind;
  motion.center = motion.from = motion.to = position;
  motion.radius = size;
  motion.from[0] -= size;
  motion.to[0] += size;
}

void edit_motion(const Float3& position, LightMotion& motion, float step) {
  if (motion.kind == LightMotion::Kind::kKeys) {
    ImGui::TextUnformatted("moves by its light path");
    return;
  }
  int kind = static_cast<int>(motion.kind);
  if (ImGui::Combo("motion", &kind, "still\0circle\0swing\0")) {
    begin_motion(position, static_cast<LightMotion::Kind>(kind), 20 * step, motion);
  }
  if (motion.kind == LightMotion::Kind::kStill) return;
  ImGui::DragFloat("period", &motion.period, 0.05F, 0.1F, 600, "%.1f s",
                   ImGuiSliderFlags_AlwaysClamp);
  if (motion.kind == LightMotion::Kind::kCircle) {
    edit_place("centre", motion.center, step);
    ImGui::DragFloat("circle", &motion.radius, step, 0, 1e6F, "%.2f m",
                     ImGuiSliderFlags_AlwaysClamp);
  } else {
    edit_place("from", motion.from, step);
    edit_place("to", motion.to, step);
  }
}

void edit_sphere(ViewerSphere& sphere, float size) {
  const float step = kStepPart * size;
  ImGui::Checkbox("there", &sphere.on);
  edit_color("reflects", sphere.reflectance);
  ImGui::DragFloat("radius", &sphere.radius, 0.2F * step, 1e-3F, 1e4F, "%.2f m",
                   ImGuiSliderFlags_AlwaysClamp);
  if (sphere.motion.kind == LightMotion::Kind::kStill) {
    edit_place("position", sphere.position, step);
  }
  edit_motion(sphere.position, sphere.motion, step);
}

// A line of a list to select from.
void list_line(std::size_t k, const std::string& name, std::size_t& selected) {
  ImGui::PushID(static_cast<int>(k));
  const std::string label = std::to_string(k) + (name.empty() ? "" : ": " + name);
  if (ImGui::Selectable(label.c_str(), k == selected)) selected = k;
  ImGui::PopID();
}

}  // namespace

void change_type(Light& light, LightType type, float size) {
  if (light.profile && !lamp_kind(type).uses(kProfile)) light = punctual_equivalent(light);
  const bool was_far = !lamp_kind(light.type).has_place();
  const float candela = light.intensity * candela_of_unit(light);
  light.type = type;
  complete_lengths(light, size);
  light.intensity = candela / candela_of_unit(light);
  const bool is_far = !lamp_kind(light.type).has_place();
  // Candela are not lux: start with a typical indoor value.
  if (was_far != is_far) light.intensity = is_far ? 1000 : 100 / candela_of_unit(light);
}

void edit_lamp(ViewerLight& lamp, const FlyCamera& camera, float size) {
  Light& light = lamp.light;
  const float step = kStepPart * size;
  ImGui::Checkbox("on", &lamp.on);
  edit_type(light, size);
  const LampKind& kind = lamp_kind(light.type);
  ImGui::BeginDisabled(lamp.motion.kind == LightMotion::Kind::kKeys);  // keys have their own
  edit_color("colour", light.color);
  // A profile has the candela, and the intensity is their factor.
  const std::string unit = light.profile ? "x profile" : std::string(kind.unit);
  ImGui::DragFloat("intensity", &light.intensity, 0.01F * std::max(light.intensity, 0.1F), 0, 1e9F,
                   ("%.1f " + unit).c_str(),
                   ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoRoundToFormat);
  if (kind.uses(kDirection)) {
    edit_unit_vector(kDirection, light);
    if (ImGui::Button("Shine where I look")) light.direction = to_float3(camera.forward());
  }
  ImGui::EndDisabled();
  if (kind.has_place() && lamp.motion.kind == LightMotion::Kind::kStill) {
    edit_place("position", light.position, step);
  }
  edit_shape(light, 0.2F * step);
  if (kind.uses(kTangent) || light.profile) keep_first_side_across(light);
  if (kind.uses(kCone)) edit_cone(light);
  if (kind.has_place()) edit_motion(light.position, lamp.motion, step);
}

void Panels::smooth(const StageTimes& times) {
  // The first frames fill caches and create solvers; they are not counted.
  constexpr int kWarmUp = 3;
  const float part = frame_ < kWarmUp ? 1 : 0.1F;
  frame_ = std::min(frame_ + 1, kWarmUp);
  const auto blend = [part](double& old, double value) { old += part * (value - old); };
  blend(smoothed_.direct, times.direct);
  for (std::size_t k = 0; k < kSideCount; ++k) blend(smoothed_.solve[k], times.solve[k]);
  blend(smoothed_.upload, times.upload);
  blend(smoothed_.shadows, times.shadows);
  blend(smoothed_.draw, times.draw);
  if (smoothed_.card.size() != times.card.size()) smoothed_.card = times.card;
  for (std::size_t k = 0; k < times.card.size(); ++k) {
    smoothed_.card[k].name = times.card[k].name;
    blend(smoothed_.card[k].microseconds, times.card[k].microseconds);
  }
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
    draw_spheres(state, frame);
    ImGui::PopItemWidth();
  }
  ImGui::End();
}

void Panels::draw_view(ViewerState& state, const FrameDrawer& frame) const {
  ImGui::Text("%zu patches, %s operator", frame.scene().data().patches.size(),
              operator_name(frame.scene().data().transfer->kind()));
  if (!ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) return;
  for (std::size_t k = 0; k < kShows.size(); ++k) {
    if (k % 3 != 0) ImGui::SameLine(100 * static_cast<float>(k % 3));
    if (ImGui::RadioButton(kShows[k].name, state.show == kShows[k].show)) {
      state.show = kShows[k].show;
    }
  }
  ImGui::SliderFloat("exposure", &state.exposure, -16, 16, "%+.1f EV",
                     ImGuiSliderFlags_AlwaysClamp);
  if (ImGui::Button("Find exposure")) state.wants_exposure = true;
  if (!frame.scene().emitter_lamps().empty()) {
    ImGui::Checkbox("shadow maps of emitters", &state.draws_emitter_lamps);
  }
  if (state.show != Show::kError) return;
  if (!frame.scene().has_reference()) {
    ImGui::TextWrapped(
        "The file has no form factors to compare with: precompute --store-form-factors.");
    return;
  }
  ImGui::Text("error, area-weighted  %.2e", frame.scene().error(Side::kFirst));
  if (state.is_split) ImGui::Text("right                 %.2e", frame.scene().error(Side::kSecond));
  ImGui::Text("yellow is             %.2e", static_cast<double>(frame.error_top()));
  if (std::ranges::any_of(state.shown_methods(), &IndirectMethod::on_card)) {
    ImGui::TextWrapped("For the graphics card: the error of the product on the processor.");
  }
}

void Panels::draw_methods(ViewerState& state, const FrameDrawer& frame) const {
  if (!ImGui::CollapsingHeader("Indirect light", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const TransferData& data = frame.scene().data();
  choose_method(state.is_split ? "left" : "method", data, frame.has_card(), state.methods[0]);
  if (!frame.card_refusal().empty()) {
    ImGui::TextWrapped("%s: %s", kCardName, frame.card_refusal().c_str());
  }
  ImGui::Checkbox("split the screen", &state.is_split);
  if (!state.is_split) return;
  ImGui::SliderFloat("at", &state.split, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp);
  choose_method("right", data, frame.has_card(), state.methods[1]);
}

void Panels::draw_times(const ViewerState& state) const {
  if (!ImGui::CollapsingHeader("Time of a frame", ImGuiTreeNodeFlags_DefaultOpen)) return;
  if (!ImGui::BeginTable("times", 2)) return;
  constexpr float kNumbers = 90;  // pixels
  ImGui::TableSetupColumn("stage", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("time", ImGuiTableColumnFlags_WidthFixed, kNumbers);
  const StageTimes& t = smoothed_;
  time_row("direct light, patches", t.direct);
  time_row(state.is_split ? "indirect light, left" : "indirect light", t.solve[0]);
  if (state.is_split) time_row("indirect light, right", t.solve[1]);
  time_row("vertices and upload", t.upload);
  time_row("shadow maps", t.shadows);
  time_row("drawing", t.draw);
  double on_card = 0;
  for (const GpuStageTime& stage : t.card) {
    time_row((std::string("card: ") + stage.name).c_str(), stage.microseconds);
    on_card += stage.microseconds;
  }
  const double solve = t.solve[0] + (state.is_split ? t.solve[1] : 0);
  time_row("all", t.direct + solve + t.upload + t.shadows + on_card + t.draw);
  ImGui::EndTable();
}

void Panels::draw_lights(ViewerState& state, const FrameDrawer& frame) const {
  if (!ImGui::CollapsingHeader("Lights", ImGuiTreeNodeFlags_DefaultOpen)) return;
  const float size = frame.bounds().diagonal();
  ImGui::Checkbox("play motions", &state.playing);
  for (std::size_t k = 0; k < state.lights.size(); ++k) {
    list_line(k, state.lights[k].light.name, state.selected);
  }
  if (ImGui::Button("Add")) {
    const glm::vec3 ahead = state.camera.forward();
    state.add_lamp(state.camera.position() + 0.3F * size * ahead, ahead, size);
  }
  ImGui::SameLine();
  if (ImGui::Button("Add 64")) state.add_many_lamps(frame.bounds().low, frame.bounds().high);
  if (state.selected < state.lights.size()) {
    ImGui::SameLine();
    const bool remove = ImGui::Button("Remove");
    ImGui::Separator();
    edit_lamp(state.lights[state.selected], state.camera, size);
    if (remove) state.remove_lamp(state.selected);
  }
  ImGui::Separator();
  edit_color("sky", state.sky.color);
  ImGui::DragFloat("luminance", &state.sky.luminance, 0.01F * std::max(state.sky.luminance, 1.0F),
                   0, 1e6F, "%.1f cd/m2", ImGuiSliderFlags_AlwaysClamp);
}

void Panels::draw_spheres(ViewerState& state, const FrameDrawer& frame) const {
  if (!ImGui::CollapsingHeader("Moving spheres")) return;
  const float size = frame.bounds().diagonal();
  ImGui::PushID("spheres");
  ImGui::Checkbox("show spheres", &state.shows_spheres);
  for (std::size_t k = 0; k < state.spheres.size(); ++k) list_line(k, "", state.selected_sphere);
  if (ImGui::Button("Add")) {
    state.add_sphere(state.camera.position() + 0.25F * size * state.camera.forward(), size);
  }
  if (state.selected_sphere < state.spheres.size()) {
    ImGui::SameLine();
    const bool remove = ImGui::Button("Remove");
    ImGui::Separator();
    edit_sphere(state.spheres[state.selected_sphere], size);
    if (remove) state.remove_sphere(state.selected_sphere);
  }
  ImGui::PopID();
}

}  // namespace rebounce
