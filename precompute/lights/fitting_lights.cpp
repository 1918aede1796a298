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

// After those of the three kinds of training lights.
constexpr int kValidationDraw = 3;

/// The seed of the lights that are drawn as number `draw`.
std::uint64_t seed_of_draw(std::uint64_t seed, int draw) {
  for (int k = 0; k <= draw; ++k) seed = mix_bits(seed);
  return seed;
}

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

std::vector<std::vector<Float3>> draw_training_lights(const TransferData& data,
                                                      const RayTracer& tracer, std::uint64_t seed,
                                                      const PatchRoles& roles) {
  std::vector<std::vector<Float3>> lights;
  int draw = 0;
  for (const auto& [kind, count] : {std::pair(LightKind::kPoint, kTrainingPointCount),
                                    std::pair(LightKind::kSpot, kTrainingSpotCount),
                                    std::pair(LightKind::kSky, kTrainingSunCount)}) {
    std::ranges::move(
        random_initial_exitances(data, tracer, kind, count, seed_of_draw(seed, draw++), roles),
        std::back_inserter(lights));
  }
  // The lamps of the scene itself are certain to be used.
  roles.keep(PatchRoles::kSource, lights.emplace_back(own_exitance(data, tracer)));
  return lights;
}

FittingLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                  std::uint64_t seed, const PatchRoles& roles) {
  FittingLights lights{draw_training_lights(data, tracer, seed, roles), {}};
  lights.validation.push_back(lights.training.back());
  std::ranges::move(random_initial_exitances(data, tracer, LightKind::kPoint, kValidationPointCount,
                                             seed_of_draw(seed, kValidationDraw), roles),
                    std::back_inserter(lights.validation));
  return lights;
}

}  // namespace rebounce
