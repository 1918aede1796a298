#include <algorithm>
#include <memory>
#include <utility>

#include "precompute/build/build_estimate.h"
#include "precompute/build/build_record.h"
#include "precompute/build/operator_stage.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/matrix_free_transfer.h"
#include "precompute/exchange/links/link_fitting.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/lights/measured_error.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/lights/solve_batches.h"
#include "precompute/lights/whole_error.h"
#include "rebounce/error.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

// Point lights among the validation lights of the operator that are also validation lights of the
// form factors.
constexpr std::size_t kFormFactorValidationCount = 64;

// Residual of the radiosities that form factors are fitted to and measured with. Their third digit
// does not matter.
constexpr double kFittingResidual = 1e-2;

// Lower limit of the tolerance of form factors in half precision, whose rounding error is not far
// below.
constexpr double kLeastTolerance = 1e-4;

using Lights = std::vector<std::vector<Float3>>;
using Exitances = std::span<const std::vector<Float3>>;

/// The radiosities of initial exitances. Throws Cancelled if asked to stop.
Lights radiosities_of(const ReferenceSolver& solver, Exitances exitances,
                      const Progress& progress) {
  return solve_batches(exitances, progress, [&](Exitances some) {
    Lights radiosities;
    for (const auto& solution : solver.radiosities(some, kFittingResidual)) {
      radiosities.push_back(rounded(solution));
    }
    return radiosities;
  });
}

/// The training, validation and test lights of the compressions.
struct FittedLights {
  DrawnLights exitances, radiosities;
  Lights test_radiosities;
};

FittedLights find_lights(const RayTracer& tracer, const TransferData& data, const PatchRoles& roles,
                         std::uint64_t seed, const ReferenceSolver& solver,
                         const Progress& progress) {
  FittedLights lights;
  lights.exitances = draw_fitting_lights(data, tracer, seed, roles);
  const Lights tests =
      random_initial_exitances(data, tracer, LightKind::kPoint, kFormFactorLightCount, seed, roles);
  const Exitances training = lights.exitances.training, validation = lights.exitances.validation;
  const Exitances few =
      validation.first(std::min(validation.size(), 1 + kFormFactorValidationCount));
  const auto all = static_cast<double>(training.size() + few.size() + tests.size());
  std::size_t before = 0;
  const auto solve = [&](Exitances some) {
    const double begin = before / all, part = some.size() / all;
    before += some.size();
    return radiosities_of(solver, some,
                          [&](double done) { return !progress || progress(begin + part * done); });
  };
  lights.radiosities.training = solve(training);
  lights.radiosities.validation = solve(few);
  lights.test_radiosities = solve(tests);
  return lights;
}

/// The reference of errors at receivers, as a fraction of all light that patches reflect.
double received_part(const DrawnLights& exitances, const DrawnLights& radiosities,
                     const PatchRoles& roles, std::span<const float> area) {
  ErrorReference received;
  for (std::size_t k = 0; k < exitances.training.size(); ++k) {
    std::vector<Float3> reflected = radiosities.training[k];
    for (std::size_t i = 0; i < reflected.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) reflected[i][c] -= exitances.training[k][i][c];
    }
    const double all = area_norm(reflected, area);
    roles.keep(PatchRoles::kReceiver, reflected);
    received.add(area_norm(reflected, area), all);
  }
  return received.part();
}

/// The tolerance of the settings, or a fraction of that of the operator. Errors of F spread
/// everywhere, and those of the operator are relative to what arrives at receivers.
double form_factor_tolerance(const BuildSettings& decided, const FittedLights& lights,
                             const PatchRoles& roles, std::span<const float> area) {
  if (decided.form_factor_tolerance > 0) return decided.form_factor_tolerance;
  const double part = received_part(lights.exitances, lights.radiosities, roles, area);
  return std::max(kLeastTolerance, decided.tolerance / kToleranceOverFormFactors * part);
}

}  // namespace

void make_operator_from_links(const RayTracer& tracer, std::span<const std::uint32_t> shown_patch,
                              const BuildSettings& decided, const PatchRoles& roles,
                              TransferData& data, BuildReport& report, PhaseClock& clock) {
  const PatchTable& patches = data.patches;
  const std::uint64_t seed = decided.form_factors.seed;
  const double tolerance = kCompressionPart * decided.tolerance;
  const LinkedBuild build{.scene = built_scene(patches.size(), data.mesh),
                          .link_count = data.links.pair.size(),
                          .matrix_count = distinct_channels(patches.reflectance),
                          .roles = roles,
                          .tolerance = tolerance};
  // Used from the first light to the last check, so it is made once.
  const auto links =
      std::make_shared<const LinkedFormFactors>(data.links, patches.area, patches.centroid);
  const ReferenceSolver reference(links, patches);
  FormFactorLinks fewer = clock.run("fewer links", [&](const Progress& part) {
    return fit_links(data.links, patches, kErrorPerLink, part);
  });
  FittedLights lights = clock.run("fitting lights", [&](const Progress& part) {
    // The third digit of the radiosities does not matter here.
    const ReferenceSolver solver(
        std::make_shared<const LinkedFormFactors>(fewer, patches.area, patches.centroid), patches);
    return find_lights(tracer, data, roles, seed, solver, part);
  });
  report.form_factor_tolerance = form_factor_tolerance(decided, lights, roles, patches.area);
  data.compressed_form_factors = clock.run("form factor compression", [&](const Progress& part) {
    return compress_form_factors(data.links, links, patches, lights.radiosities.view(),
                                 {report.form_factor_tolerance, Precision::kF16}, part);
  });
  data.transfer = clock.run("operator", [&](const Progress& part) {
    MatrixFreeTransferSettings settings;
    settings.compression = {tolerance, *decided.precision};
    settings.roles = roles;
    settings.memory_limit_bytes = memory_of_matrix_free_transfer(build, decided.memory_limit_bytes);
    settings.checkpoint = decided.checkpoint;
    return build_matrix_free_transfer(*data.compressed_form_factors, patches,
                                      lights.exitances.view(), settings, part);
  });
  const ReferenceSolver solver = reference.preconditioned(data.transfer);
  WholeErrorEstimator whole(data, roles, seed, WholeErrorEstimator::sample_for(patches.size()));
  const std::vector<KindError> errors = clock.run("check", [&](const Progress& part) {
    report.form_factor_error =
        form_factor_error(*data.compressed_form_factors, *links, patches, lights.test_radiosities);
    if (roles.all_are_both()) {
      data.record.solve_residual = transfer_residual(*data.transfer, *links, patches);
    }
    lights = {};  // what follows takes their memory
    return measure_error(data, tracer, solver, decided.tolerance, seed, part,
                         [&](const auto&... light) { whole.add(light...); });
  });
  report.whole_error = clock.run("check by rays", [&](const Progress& part) {
    return whole.estimate(shown_patch, tracer, solver, part);
  });
  // The check is the last step that needs all of them.
  data.links = decided.store_links ? std::move(fewer) : FormFactorLinks{};
  if (decided.store_links) report.link_count = data.links.pair.size();
  record_build(decided, report, errors, data);
}

}  // namespace rebounce
