#include "precompute/lights/fitting_lights.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "precompute/lights/random_lights.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Measured: notes/operator.md.
constexpr int kShapingPointCount = 128, kShapingSpotCount = 32, kShapingSunCount = 32;
constexpr int kJudgingPointCount = 512;

static_assert(kMostShapingLights == kShapingPointCount + kShapingSpotCount + kShapingSunCount + 1);
static_assert(kMostJudgingLights == kJudgingPointCount + 1);

}  // namespace

DrawnLights draw_fitting_lights(const TransferData& data, const RayTracer& tracer,
                                std::uint64_t seed, const PatchRoles& roles) {
  const auto draw = [&](LightKind kind, int count) {
    seed = mix_bits(seed);
    return random_initial_exitances(data, tracer, kind, count, seed, roles);
  };
  DrawnLights lights;
  for (const auto& [kind, count] : {std::pair(LightKind::kPoint, kShapingPointCount),
                                    std::pair(LightKind::kSpot, kShapingSpotCount),
                                    std::pair(LightKind::kSky, kShapingSunCount)}) {
    std::ranges::move(draw(kind, count), std::back_inserter(lights.shaping));
  }
  // The scene's own lamps are sure to be used.
  std::vector<Float3> own = data.patches.emitted_exitance;
  roles.keep(PatchRoles::kSource, own);
  lights.shaping.push_back(own);
  lights.judging.push_back(std::move(own));
  std::ranges::move(draw(LightKind::kPoint, kJudgingPointCount),
                    std::back_inserter(lights.judging));
  return lights;
}

}  // namespace rebounce
