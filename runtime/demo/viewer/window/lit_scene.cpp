
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "runtime/demo/shading/patch_errors.h"
#include "runtime/demo/shading/picture_light.h"
#include "runtime/demo/viewer/window/lit_scene.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/lights/sky_light.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

// Each draws the scene 96 times once, and takes 96 MiB (lab/152).
constexpr std::size_t kMostRectangles = 4;

}  // namespace

LitScene::LitScene(std::shared_ptr<const TransferData> data, Reference reference,
                   MakeProbes make_probes)
    : data_(std::move(data)),
      engine_(data_),
      emitted_(irradiance_from_emitters(*data_)),
      rectangles_(find_emitting_rectangles(*data_, kMostRectangles)),
      other_emitted_(light_of_other_emitters()),
      solver_{IndirectSolver(*data_), IndirectSolver(*data_)},
      pictures_(*data_, *engine_.parts().tracer),
      reference_(std::move(reference)),
      make_probes_(std::move(make_probes)) {
  for (auto& values : indirect_) values.resize(data_->patches.size());
  for (auto& values : reflected_) values.resize(data_->patches.size());
}

std::vector<Float3> LitScene::light_of_other_emitters() {
  if (rectangles_.lamps.empty()) return emitted_;
  if (!rectangles_.leave_any(*data_)) return {};
  engine_.parts().compute_direct(rectangles_.lamps, {});
  std::vector<Float3> rest = emitted_;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const glm::vec3 light = to_glm(emitted_[i]) - to_glm(engine_.direct_irradiance()[i]);
    rest[i] = to_float3(glm::max(light, glm::vec3(0)));
  }
  return rest;
}

void LitScene::relight(std::span<const Light> lights, const Sky& sky,
                       std::span<const IndirectMethod, kSideCount> methods, bool both,
                       bool patches_of_card, StageTimes& times) {
  direct_light(lights, sky, times);
  engine_.parts().compute_initial_exitance();
  for (std::size_t side = 0; side < (both ? kSideCount : 1); ++side) {
    times.solve[side] = 0;
    if (methods[side].on_card && !patches_of_card) continue;
    IndirectSolver& solver = solver_[side];
    if (solver.method() != methods[side]) solver.choose(methods[side]);
    std::ranges::copy(solver.solve(engine_.initial_exitance()), indirect_[side].begin());
    times.solve[side] = solver.microseconds();
    for (std::size_t i = 0; i < indirect_[side].size(); ++i) {
      const glm::vec3 irradiance =
          to_glm(engine_.direct_irradiance()[i]) + to_glm(indirect_[side][i]);
      reflected_[side][i] = to_float3(to_glm(data_->patches.reflectance[i]) * irradiance);
    }
  }
}

std::span<const Float3> LitScene::direct_light(std::span<const Light> lights, const Sky& sky,
                                               StageTimes& times) {
  const auto begin = std::chrono::steady_clock::now();
  engine_.parts().compute_direct(lights, sky);
  const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - begin;
  times.direct += time.count();
  return engine_.direct_irradiance();
}

const LightProbes& LitScene::probes() {
  if (data_->probes.size() > 0 || !make_probes_) return data_->probes;
  if (!own_probes_) own_probes_ = make_probes_();
  return *own_probes_;
}

LightInAir LitScene::light_in_air(const Float3& position, std::span<const Float3> normals,
                                  const Sky& sky, bool both) {
  LightInAir light;
  light.first_flight.resize(normals.size());
  for (auto& irradiance : light.bounced) irradiance.resize(normals.size());
  const LightProbes& around = probes();
  if (around.size() == 0) return light;
  // Lamps and openings are small and bright; bounced light is smooth enough for harmonics.
  irradiance_in_air(around, data_->patches.emitted_exitance, sky, position, normals,
                    light.first_flight);
  for (std::size_t side = 0; side < (both ? kSideCount : 1); ++side) {
    const ProbeLight bounced = gather_probe_light(around, reflected_[side], {}, position);
    for (std::size_t k = 0; k < normals.size(); ++k) {
      light.bounced[side][k] = probe_irradiance(bounced, normals[k]);
    }
  }
  return light;
}

std::vector<glm::vec3> LitScene::first_flight_at_vertices(const Sky& sky,
                                                          bool draws_emitter_lamps) const {
  const std::span<const Float3> emitted = draws_emitter_lamps ? other_emitted_ : emitted_;
  std::vector<glm::vec3> value(data_->patches.size());
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] = to_glm(sky_irradiance(*data_, sky, i));
    if (!emitted.empty()) value[i] += to_glm(emitted[i]);
  }
  return reconstruct_at_vertices(data_->mesh, value);
}

std::vector<glm::vec3> LitScene::bounced_at_vertices(Side side) const {
  const PictureLight light{.indirect_irradiance = indirect(side),
                           .emitted_irradiance = emitted_,
                           .reflected_exitance = reflected_[index(side)]};
  return light_at_vertices(*data_, light).bounced;
}

std::vector<float> LitScene::patch_errors(Side side) {
  if (!reference_) return {};
  const auto exitance = engine_.initial_exitance();
  if (!std::ranges::equal(exitance, reference_exitance_)) {
    reference_indirect_ = reference_(exitance);
    reference_exitance_.assign(exitance.begin(), exitance.end());
  }
  const PatchTable& patches = data_->patches;
  error_[index(side)] = relative_difference(indirect(side), reference_indirect_, patches.area);
  return rebounce::patch_errors(indirect(side), reference_indirect_, patches.area);
}

float LitScene::find_exposure(std::span<const Light> lights, const Sky& sky, const Camera& camera,
                              Show show) const {
  return exposure_for(pictures_,
                      {.lights = lights,
                       .sky = sky,
                       .indirect_irradiance = indirect(Side::kFirst),
                       .emitted_irradiance = emitted_,
                       .reflected_exitance = reflected_[index(Side::kFirst)]},
                      camera, shows_light(show) ? show : Show::kRadiosity);
}

}  // namespace rebounce
