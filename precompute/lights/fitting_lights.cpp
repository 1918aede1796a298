#include "precompute/lights/fitting_lights.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "precompute/lights/random_lights.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Numbers of training lights (lab/043).
constexpr int kTrainingPointCount = 128, kTrainingSpotCount = 32, kTrainingSunCount = 32;
constexpr int kValidationPointCount = 512;  // lab/047: fewer let more single lights err

static_assert(kMostTrainingLights ==
              kTrainingPointCount + kTrainingSpotCount + kTrainingSunCount + 1);
static_assert(kMostValidationLights == kValidationPointCount + 1);

struct Drawing {
  const TransferData& data;
  const RayTracer& tracer;
  const PatchRoles& roles;
  std::uint64_t seed;
  std::size_t parts = 1;

  std::vector<std::vector<Float3>> draw(LightKind kind, int count) {
    seed = mix_bits(seed);
    return random_initial_exitances(data, tracer, kind, count, seed, roles, parts);
  }

  /// One for `share` of the training lights. The lamps of the scene itself are certain to be used:
  /// they come last.
  std::vector<std::vector<Float3>> draw_training(int share) {
    std::vector<std::vector<Float3>> lights;
    for (const auto& [kind, count] : {std::pair(LightKind::kPoint, kTrainingPointCount),
                                      std::pair(LightKind::kSpot, kTrainingSpotCount),
                                      std::pair(LightKind::kSky, kTrainingSunCount)}) {
      std::ranges::move(draw(kind, count / share), std::back_inserter(lights));
    }
    std::vector<Float3> own = data.patches.emitted_exitance;
    roles.keep(PatchRoles::kSource, own);
    lights.emplace_back();
    for (const Float3& exitance : own) lights.back().insert(lights.back().end(), parts, exitance);
    return lights;
  }
};

}  // namespace

DrawnLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                std::uint64_t seed, const PatchRoles& roles) {
  Drawing drawing{data, tracer, roles, seed};
  DrawnLights lights{drawing.draw_training(1), {}};
  lights.validation.push_back(lights.training.back());
  std::ranges::move(drawing.draw(LightKind::kPoint, kValidationPointCount),
                    std::back_inserter(lights.validation));
  return lights;
}

std::vector<std::vector<Float3>> draw_few_lights(const TransferData& data, const RayTracer& tracer,
                                                 std::uint64_t seed, const PatchRoles& roles,
                                                 int share, std::size_t parts) {
  return Drawing{data, tracer, roles, seed, parts}.draw_training(share);
}

}  // namespace rebounce
