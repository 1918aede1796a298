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

/// A pair whose rays all agree may still be partly hidden: its variance is this fraction of the
/// squared exchange instead of zero.
inline constexpr double kVisibilityVarianceFloor = 1e-6;

/// The exchange of all pairs of patches from rays and kernels, before closure.
struct RawExchange {
  ExchangeRows rows;
  std::vector<Escape> escape;        ///< [n]
  std::vector<RowSumTarget> target;  ///< [n]
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs that face each other and got shadow rays
};

/// True for a pair of patch i that exchanges much light. If it is partly hidden, it gets
/// kLargeFactor times the rays of other pairs: what its rays miss shows in row sums, and its noise
/// in the ranks of blocks.
bool is_large_pair(const PatchGeometry& geometry, std::uint32_t i, const FacingPatch& pair);
inline constexpr int kLargeFactor = 6;  // lab/011: fewer raise the rank of far blocks

/// Computes the exchange of every pair of patches:
///
/// - 1. Hemisphere rays of every patch measure what escapes and which patches see each other.
/// - 2. A pair with a good kernel gets a few shadow rays. If they agree with each other and with
///   the hemisphere rays, that is the answer. Otherwise it gets all of its rays, more if it
///   exchanges much. If those do not agree either, the answer is the mean of shadow rays and
///   hemisphere rays, weighted by the inverse of their variances.
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
