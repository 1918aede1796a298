#include "precompute/lights/link_error.h"

#include <utility>
#include <vector>

#include "precompute/lights/corrected_solver.h"
#include "precompute/lights/random_lights.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/lights/solve_batches.h"
#include "precompute/lights/whole_error.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// The lights and the part of the rays that decide whether links are near enough, and how far these
// lights may be off: that counts as an error of the links.
constexpr int kJudgingLights = 64;
constexpr double kJudgingRays = 0.5, kJudgingResidual = 1e-4;

// The residual that fewer links solve to: what they are off by themselves (lab/015).
constexpr double kFewerResidual = 1e-3;

}  // namespace

SampledError error_of_links(const std::shared_ptr<const LinkedFormFactors>& links,
                            const FormFactorLinks& fewer, const TransferData& data,
                            std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                            const PatchRoles& roles, std::uint64_t seed, const Progress& progress) {
  const ReferenceSolver solver(fewer, data.patches);
  const auto nearly_exact = [&](std::span<const std::vector<Float3>> light) {
    return solve_batches(light, {}, [&](std::span<const std::vector<Float3>> some) {
      return solver.indirect_irradiances(some, kFewerResidual, kFewerResidual);
    });
  };
  // Other rays than those of the statement that is made of the operator, which chance would favour.
  WholeErrorEstimator estimator(data, roles, mix_bits(seed),
                                WholeErrorEstimator::sample_for(data.patches.size(), kJudgingRays));
  std::vector<std::vector<Float3>> lights = random_initial_exitances(
      data, tracer, LightKind::kPoint, kJudgingLights, mix_bits(seed + kJudgingLights), roles);
  auto truths = CorrectedSolver(nearly_exact, links, data.patches)
                    .indirect_irradiances(lights, {kJudgingResidual});
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const std::vector<Float3> light = std::move(lights[k]), truth = std::move(truths[k]);
    if (arrives_nowhere(truth, light, data.patches.area)) continue;
    std::vector<Float3> received = truth;
    roles.keep(PatchRoles::kReceiver, received);
    estimator.add(light, truth, received);
  }
  return estimator.estimate(shown_patch, tracer, nearly_exact, progress).links;
}

}  // namespace rebounce
