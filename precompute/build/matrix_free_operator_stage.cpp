#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "precompute/build/build_estimate.h"
#include "precompute/build/kept_tolerances.h"
#include "precompute/build/operator_stage.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/matrix_free_transfer.h"
#include "precompute/exchange/links/link_fitting.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/corrected_solver.h"
#include "precompute/lights/error_reference.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/lights/measured_error.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/lights/sparse_light.h"
#include "precompute/lights/whole_error.h"
#include "transfer/base/area_norm.h"

namespace rebounce {
namespace {

// Point lights among the validation lights of the operator that are also validation lights of the
// form factors.
constexpr std::size_t kFormFactorValidationCount = 64;

// Residual of the radiosities that form factors are fitted to and measured with. Their third digit
// does not matter.
constexpr double kFittingResidual = 1e-2;

// What form factors err by under single lamps is a part of what the operator errs by (lab/183).
constexpr double kLargestOverMeanOfFormFactors = 6;

// How far the truth of a check may be off, in parts of the error that it tells (lab/149).
constexpr double kTruthPart = 0.02;

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
  FittingLights exitances, radiosities;
  Lights test_radiosities;
};

/// Lights that wait until an operator is fitted to them.
struct WaitingLights {
  std::vector<SparseLight> training, validation;
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
double received_part(const FittingLights& exitances, const FittingLights& radiosities,
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
  return std::max(kLeastFormFactorTolerance, decided.tolerance / kToleranceOverFormFactors * part);
}

/// What the stages of an operator from links share.
class LinkedOperator {
 public:
  LinkedOperator(std::shared_ptr<const LinkedFormFactors> links, const RayTracer& tracer,
                 const BuildSettings& decided, const PatchRoles& roles, TransferData& data,
                 BuildReport& report, PhaseClock& clock)
      : links_(std::move(links)),
        link_count_(report.link_count),
        tracer_(tracer),
        decided_(decided),
        roles_(roles),
        data_(data),
        report_(report),
        clock_(clock) {}

  std::vector<KindError> make(FormFactorLinks fewer, std::span<const std::uint32_t> shown_patch) {
    if (fewer.empty()) {
      fewer = clock_.run("fewer links", [&](const Progress& part) {
        return fit_links(links_, data_.patches, kErrorPerLink, part);
      });
    }
    find_fitting_lights(fewer);
    if (!decided_.store_links) fewer = {};
    compress_form_factors_of();
    data_.links = std::move(fewer);
    make_operator();
    check(decided_.form_factors.seed);
    const double finer = finer_tolerance(data_.record);
    if (finer > 0) make_again(finer);
    check_by_rays(shown_patch);
    if (decided_.store_links) report_.link_count = data_.links.pair.size();
    return std::move(errors_);
  }

 private:
  double tolerance() const { return kCompressionPart * decided_.tolerance; }

  void find_fitting_lights(const FormFactorLinks& fewer) {
    // The third digit of the radiosities does not matter here.
    const auto links = std::make_shared<const LinkedFormFactors>(fewer, data_.patches.area,
                                                                 data_.patches.centroid);
    group_ = clock_.run("groups of patches", [&](const Progress& part) {
      return group_patches(links, data_.patches, part);
    });
    lights_ = clock_.run("fitting lights", [&](const Progress& part) {
      const ReferenceSolver solver(links, data_.patches);
      return find_lights(tracer_, data_, roles_, decided_.form_factors.seed, solver, part);
    });
    report_.form_factor_tolerance =
        form_factor_tolerance(decided_, lights_, roles_, data_.patches.area);
    waiting_ = {sparse_lights(std::move(lights_.exitances.training)),
                sparse_lights(std::move(lights_.exitances.validation))};
  }

  void compress_form_factors_of() {
    data_.compressed_form_factors =
        clock_.run("form factor compression", [&](const Progress& part) {
          return compress_form_factors(links_, data_.patches, group_,
                                       std::move(lights_.radiosities),
                                       {.tolerance = report_.form_factor_tolerance,
                                        .precision = Precision::kF16,
                                        .largest_over_mean = kLargestOverMeanOfFormFactors},
                                       part);
        });
    report_.form_factor_error = form_factor_error(*data_.compressed_form_factors, *links_,
                                                  data_.patches, lights_.test_radiosities);
    lights_ = {};
  }

  void make_operator() {
    const LinkedBuild build{.scene = built_scene(data_.patches.size(), data_.mesh),
                            .link_count = link_count_,
                            .matrix_count = distinct_channels(data_.patches.reflectance),
                            .roles = roles_,
                            .tolerance = tolerance()};
    MatrixFreeTransferSettings settings;
    // Links and compression share the tolerance of the mean. What single lamps may err by is for
    // compression alone, as in the check.
    settings.compression = {.tolerance = tolerance(),
                            .precision = *decided_.precision,
                            .largest_over_mean = kLargestOverMean / kCompressionPart};
    settings.roles = roles_;
    settings.group = std::move(group_);
    settings.memory_limit_bytes =
        memory_of_matrix_free_transfer(build, decided_.memory_limit_bytes);
    settings.checkpoint = decided_.checkpoint;
    data_.transfer = clock_.run("operator", [&](const Progress& part) {
      FittingLights lights{.training = expanded(waiting_.training), .validation = {}};
      solved_.emplace(*data_.compressed_form_factors, data_.patches, lights.training, settings,
                      part);
      lights.validation = expanded(waiting_.validation);
      waiting_ = {};
      return solved_->compress(std::move(lights), tolerance(),
                               part_of(part, solved_->solving_part(), 1));
    });
    report_.solve_count = solved_->solve_count();
  }

  /// The light of `exitances` by the operator or, if it has roles, by what it was made from.
  Lights nearly_exact(Exitances exitances) const {
    return roles_.all_are_both() ? indirect_irradiances(*data_.transfer, exitances)
                                 : solved_->solved().indirect_irradiances(exitances);
  }

  /// Measures the error of the operator under lights of this `seed`.
  void check(std::uint64_t seed) {
    solver_.emplace([&](Exitances lights) { return nearly_exact(lights); }, links_, data_.patches);
    const auto truth_of = [&](Exitances some) {
      return solver_->indirect_irradiances(some,
                                           {reference_residual(decided_.tolerance), kTruthPart});
    };
    whole_.emplace(data_, roles_, decided_.form_factors.seed,
                   WholeErrorEstimator::sample_for(data_.patches.size()));
    errors_ = clock_.run("check", [&](const Progress& part) {
      if (roles_.all_are_both()) {
        data_.record.solve_residual = transfer_residual(*data_.transfer, *links_, data_.patches);
      }
      return measure_error(data_, tracer_, truth_of, seed, part,
                           [&](const auto&... light) { whole_->add(light...); });
    });
    record_errors(decided_, errors_, data_.record);
  }

  /// Measures the error of links and operator together, without the links: light of what is missing
  /// spreads by the operator, or for one with roles by its compressed form factors.
  void check_by_rays(std::span<const std::uint32_t> shown_patch) {
    solver_.reset();
    links_.reset();
    if (roles_.all_are_both()) solved_.reset();
    report_.whole_error = clock_.run("check by rays", [&](const Progress& part) {
      return whole_->estimate(
          shown_patch, tracer_, [&](Exitances lights) { return nearly_exact(lights); }, part);
    });
    whole_.reset();
    solved_.reset();
  }

  /// Makes the operator again from the bases that are there, for a smaller tolerance of the
  /// light, and checks it under lights that the first check has not seen.
  void make_again(double finer) {
    whole_.reset();
    solver_.reset();
    data_.transfer = clock_.run("operator again", [&](const Progress& part) {
      return solved_->compress(
          draw_fitting_lights(data_, tracer_, decided_.form_factors.seed, roles_),
          kCompressionPart * finer, part);
    });
    check(seed_of_second_check(decided_.form_factors.seed));
  }

  std::shared_ptr<const LinkedFormFactors> links_;  ///< until lights are checked
  const std::size_t link_count_;
  const RayTracer& tracer_;
  const BuildSettings& decided_;
  const PatchRoles& roles_;
  TransferData& data_;
  BuildReport& report_;
  PhaseClock& clock_;
  std::vector<std::uint8_t> group_;  ///< of each patch, until the operator is made
  FittedLights lights_;              ///< while form factors are compressed
  WaitingLights waiting_;
  std::optional<MatrixFreeTransfer> solved_;
  std::optional<CorrectedSolver> solver_;  ///< while lights are checked
  std::optional<WholeErrorEstimator> whole_;
  std::vector<KindError> errors_;
};

}  // namespace

std::vector<KindError> make_operator_from_links(std::shared_ptr<const LinkedFormFactors> links,
                                                FormFactorLinks fewer, const RayTracer& tracer,
                                                std::span<const std::uint32_t> shown_patch,
                                                const BuildSettings& decided,
                                                const PatchRoles& roles, TransferData& data,
                                                BuildReport& report, PhaseClock& clock) {
  return LinkedOperator(std::move(links), tracer, decided, roles, data, report, clock)
      .make(std::move(fewer), shown_patch);
}

}  // namespace rebounce
