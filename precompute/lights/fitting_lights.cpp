#include "precompute/lights/fitting_lights.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "precompute/lights/random_lights.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

// Numbers of training lights (lab/043).
constexpr int kTrainingPointCount = 128, kTrainingSpotCount = 32, kTrainingSunCount = 32;
constexpr int kValidationPointCount = 512;  // lab/047: fewer let more single lights err

static_assert(kMostTrainingLights ==
              kTrainingPointCount + kTrainingSpotCount + kTrainingSunCount + 1);
static_assert(kMostValidationLights == kValidationPointCount + 1);

/// What patches send of the light of the scene's own lamps and emitters, [n] lx.
std::vector<Float3> own_exitance(const TransferData& data, const RayTracer& tracer) {
  const PatchTable& patches = data.patches;
  if (data.lights.empty()) return patches.emitted_exitance;
  std::vector<Float3> exitance(patches.size());
  DirectLighting(data, tracer).compute(data.lights, {}, exitance);
  add_reflected(patches.emitted_exitance, patches.reflectance, exitance, exitance);
  return exitance;
}

}  // namespace

DrawnLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                std::uint64_t seed, const PatchRoles& roles) {
  const auto draw = [&](LightKind kind, int count) {
    seed = mix_bits(seed);
    return random_initial_exitances(data, tracer, kind, count, seed, roles);
  };
  DrawnLights lights;
  for (const auto& [kind, count] : {std::pair(LightKind::kPoint, kTrainingPointCount),
                                    std::pair(LightKind::kSpot, kTrainingSpotCount),
                                    std::pair(LightKind::kSky, kTrainingSunCount)}) {
    std::ranges::move(draw(kind, count), std::back_inserter(lights.training));
  }
  // The lamps of the scene itself are certain to be used.
  std::vector<Float3> own = own_exitance(data, tracer);
  roles.keep(PatchRoles::kSource, own);
  lights.training.push_back(own);
  lights.validation.push_back(std::move(own));
  std::ranges::move(draw(LightKind::kPoint, kValidationPointCount),
                    std::back_inserter(lights.validation));
  return lights;
}

}  // namespace rebounce
