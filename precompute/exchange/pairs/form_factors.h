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

/// Finds the form factors of every pair of patches: the exact exchange of the unoccluded patches
/// times the kernel-weighted part of shadow rays that get through (form_factor_kernel.h), joined
/// with what hemisphere rays count, which alone speak for near patches of many triangles; corrected
/// so that reciprocity and closure hold together (closure.h).
///
/// `tracer` holds the first surface_count triangles of model.mesh. Rows are shared out among OpenMP
/// threads; the bits do not depend on how many. Throws Cancelled when `progress` says so.
FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings = {},
                                 const Progress& progress = {});

/// What compute_form_factors will take: by a sample of the pairs, in about a hundredth of the time.
/// Rough. Throws Cancelled when `progress` says so.
FormFactorForecast forecast_form_factors(const PatchModel& model, const RayTracer& tracer,
                                         const FormFactorSettings& settings = {},
                                         const Progress& progress = {});

}  // namespace rebounce
