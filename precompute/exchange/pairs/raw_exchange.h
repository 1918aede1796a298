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

/// A pair whose rays all agree may still be partly hidden: its variance is not zero but this part
/// of the squared exchange.
inline constexpr double kVisibilityVarianceFloor = 1e-6;

/// The exchange of all pairs of patches as rays and kernels have it, before closure.
struct RawExchange {
  ExchangeRows rows;
  std::vector<Escape> escape;     ///< [n]
  std::vector<RowTarget> target;  ///< [n]
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs that face each other and were asked by shadow rays
};

/// True for a pair of patch i that exchanges so much that, if it is partly hidden, it gets
/// kLargeFactor times the rays of others: what they miss is seen in the sums of rows, and their
/// noise in the ranks of blocks.
bool is_large_pair(const PatchGeometry& geometry, std::uint32_t i, const FacingPatch& pair);
inline constexpr int kLargeFactor = 6;

/// Looks at every pair of patches:
///
/// - 1. Hemisphere rays of every patch say what escapes, and which patches see each other.
/// - 2. A pair with a good kernel gets a few shadow rays. If they agree with each other and with
/// the
///   hemisphere rays, that is the answer; else it gets all of its rays, the more the more it
///   exchanges, and if those do not agree either the mean of what they and the hemisphere rays say,
///   weighted by the inverse of their variances.
/// - 3. A near pair of many triangles is taken from the hemisphere rays alone.
/// - 4. Rows whose sum is off its target get more probe rays for every pair
/// (adaptive_row_sampling.h).
///
/// Rows are shared out among OpenMP threads; the bits do not depend on how many. Throws Cancelled
/// when `progress` says so.
RawExchange compute_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                 const RayTracer& tracer, const FormFactorSettings& settings,
                                 const Progress& progress);

/// What compute_raw_exchange will take but for its fourth step, by what the others take for one in
/// 32 patches, 512 at most: a thirtieth of the first, a thousandth of those of pairs. Throws
/// Cancelled when `progress` says so.
FormFactorForecast forecast_raw_exchange(const PatchModel& model, const ShadowRays& shadow_rays,
                                         const RayTracer& tracer,
                                         const FormFactorSettings& settings,
                                         const Progress& progress);

}  // namespace rebounce
