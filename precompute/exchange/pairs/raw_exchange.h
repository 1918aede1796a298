#pragma once

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce {

/// The exchange of all pairs of patches from rays and kernels, before closure.
struct RawExchange {
  ExchangeRows rows;
  std::vector<Escape> escape;        ///< [n]
  std::vector<RowSumTarget> target;  ///< [n]
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs that face each other and got shadow rays
};

/// Computes the exchange of every pair of patches:
///
/// - 1. Hemisphere rays of every patch measure what escapes and which patches see each other.
/// - 2. A pair with a good kernel is measured by shadow rays too (pair_exchange.h).
/// - 3. A near pair of many triangles uses the hemisphere rays alone.
/// - 4. Rows whose sum is off its target get more probe rays for every pair
///   (adaptive_row_sampling.h).
///
/// OpenMP threads share the rows; the bits do not depend on their number. Throws Cancelled if
/// `progress` asks to stop.
RawExchange compute_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                 const RayTracer& tracer, const FormFactorSettings& settings,
                                 const Progress& progress);

/// Forecasts the work of compute_raw_exchange, without its fourth step, from a sample of one in 32
/// patches, at most 512: a thirtieth of the work of the first step and a thousandth of that of the
/// pairs. Throws Cancelled if `progress` asks to stop.
FormFactorForecast forecast_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                         const RayTracer& tracer,
                                         const FormFactorSettings& settings,
                                         const Progress& progress);

}  // namespace rebounce
