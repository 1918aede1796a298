#include "precompute/build/operator_stage.h"

#include <fmt/format.h>

#include "precompute/build/kept_tolerances.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/compression/hierarchical_transfer.h"
#include "precompute/compression/low_rank_transfer.h"
#include "precompute/inverse/dense_transfer.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/lights/measured_error.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

// A larger residual is a mistake and no rounding error, for f32 and f16 entries.
constexpr double kLargestResidualF32 = 1e-4, kLargestResidualF16 = 5e-3;

void check_residual(double residual, Precision precision) {
  const double largest = precision == Precision::kF16 ? kLargestResidualF16 : kLargestResidualF32;
  if (residual <= largest) return;
  throw Error(
      fmt::format("the operator fails its own check: its residual is {:.2e}, the limit is {:.0e}; "
                  "please report this scene",
                  residual, largest));
}

std::shared_ptr<const TransferOperator> compress(const DenseOperator& dense,
                                                 const TransferData& data, const RayTracer& tracer,
                                                 const BuildSettings& settings,
                                                 const PatchRoles& roles,
                                                 const Progress& progress) {
  if (settings.operator_kind != OperatorKind::kHierarchical) {
    return build_low_rank_transfer(dense, {settings.rank, *settings.precision}, progress);
  }
  return build_hierarchical_transfer(
      dense, data.patches, draw_fitting_lights(data, tracer, settings.form_factors.seed, roles),
      {settings.tolerance, *settings.precision}, progress, roles);
}

/// Compresses the form factors of `data` and measures their error, with an operator of all patches.
void compress_form_factors_of(TransferData& data, const TransferOperator& transfer,
                              const RayTracer& tracer, const BuildSettings& settings,
                              BuildReport& report, const Progress& progress) {
  const std::uint64_t seed = settings.form_factors.seed;
  report.form_factor_tolerance = settings.form_factor_tolerance;
  const std::vector<Float3>& reflectance = data.patches.reflectance;
  const FittingLights drawn = draw_fitting_lights(data, tracer, seed);
  FittingLights fitting{radiosities_of(transfer, reflectance, drawn.training),
                        radiosities_of(transfer, reflectance, drawn.validation)};
  data.compressed_form_factors =
      compress_form_factors(data.exchange, data.patches, std::move(fitting),
                            {settings.form_factor_tolerance, Precision::kF16}, progress);
  report.form_factor_error = form_factor_error(
      *data.compressed_form_factors, FormFactorRows(data.exchange, data.patches.area), data.patches,
      radiosities_of(
          transfer, reflectance,
          random_initial_exitances(data, tracer, LightKind::kPoint, kFormFactorLightCount, seed)));
}

/// Measures the error of the operator against `exact` or, if that is null, against an iterative
/// solution, and records it. `seed`: of the lights.
std::vector<KindError> check_operator(TransferData& data, const RayTracer& tracer,
                                      const DenseOperator* exact, const BuildSettings& decided,
                                      std::uint64_t seed, PhaseClock& clock) {
  std::vector<KindError> errors = clock.run("check", [&](const Progress& part) {
    if (data.transfer->roles().all_are_both()) {
      data.record.solve_residual = transfer_residual(*data.transfer, data.exchange, data.patches);
    }
    return measure_error(data, tracer, exact, seed, part);
  });
  record_errors(decided, errors, data.record);
  return errors;
}

}  // namespace

std::vector<KindError> make_operator_from_pairs(const RayTracer& tracer,
                                                const BuildSettings& decided,
                                                const PatchRoles& roles, TransferData& data,
                                                BuildReport& report, PhaseClock& clock) {
  const bool compressed = decided.operator_kind != OperatorKind::kDense;
  const Precision dense_precision = compressed ? Precision::kF32 : *decided.precision;
  const auto dense = clock.run("operator", [&](const Progress& part) {
    return build_dense_transfer(data.exchange, data.patches, dense_precision, part,
                                arithmetic_of(decided.operator_kind));
  });
  check_residual(transfer_residual(*dense, data.exchange, data.patches), dense_precision);
  data.transfer = dense;
  if (compressed) {
    data.transfer = clock.run("compression", [&](const Progress& part) {
      return compress(*dense, data, tracer, decided, roles, part);
    });
  }
  if (decided.form_factor_tolerance > 0) {
    clock.run("form factor compression", [&](const Progress& part) {
      const TransferOperator& whole = roles.all_are_both() ? *data.transfer : *dense;
      compress_form_factors_of(data, whole, tracer, decided, report, part);
      return true;
    });
  }
  const std::uint64_t seed = decided.form_factors.seed;
  std::vector<KindError> errors =
      check_operator(data, tracer, compressed ? dense.get() : nullptr, decided, seed, clock);
  const double finer = finer_tolerance(data.record);
  if (finer == 0) return errors;
  BuildSettings again = decided;
  again.tolerance = finer;
  data.transfer = clock.run("compression again", [&](const Progress& part) {
    return compress(*dense, data, tracer, again, roles, part);
  });
  return check_operator(data, tracer, dense.get(), decided, seed_of_second_check(seed), clock);
}

}  // namespace rebounce
