#pragma once

#include <cstdint>

#include "precompute/base/progress.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/exchange/exchange_matrix.h"

namespace rebounce {

struct FormFactors : EscapedLight {
  ExchangeMatrix exchange;
  ClosureReport closure;
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs of patches that face each other
};

/// Computes the form factors of every pair of patches: the exact exchange of the unoccluded patches
/// (form_factor_kernel.h) times the kernel-weighted fraction of shadow rays that pass, combined
/// with the counts of hemisphere rays. Near patches of many triangles use hemisphere rays alone. A
/// correction then makes reciprocity and closure hold together (closure.h).
///
/// `tracer` holds the first surface_count triangles of model.mesh. OpenMP threads share the rows;
/// the bits do not depend on their number. Throws Cancelled if `progress` asks to stop.
FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings = {},
                                 const Progress& progress = {});

/// Forecasts the work of compute_form_factors from a sample of the pairs, in about a hundredth of
/// the time. The result is rough. Throws Cancelled if `progress` asks to stop.
FormFactorForecast forecast_form_factors(const PatchModel& model, const RayTracer& tracer,
                                         const FormFactorSettings& settings = {},
                                         const Progress& progress = {});

}  // namespace rebounce
