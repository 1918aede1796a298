#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/row_sum_targets.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce {

/// Links of a whole scene after refinement and one revision where rows do not add up.
struct RefinedLinks {
  LinkTree tree;
  std::vector<Link> links;
  std::vector<Escape> escape;        ///< [n]
  std::vector<RowSumTarget> target;  ///< [n]
  std::uint64_t ray_count = 0;
  std::uint64_t candidate_count = 0;
};

/// Refines links to settings.link_epsilon, measures what escapes and those between single patches,
/// and revises the links of patches whose row sum disagrees. `weight` is that of LinkTree. Throws
/// Cancelled if asked to stop.
RefinedLinks refine_links(const PatchModel& model, const ShadowRays& shadow_rays,
                          const RayTracer& tracer, const FormFactorSettings& settings,
                          std::span<const float> weight, const Progress& progress);

/// Forecasts the number of links of a scene that exchange light, from a sample. Throws Cancelled if
/// asked to stop.
std::size_t forecast_link_count(const PatchModel& model, const RayTracer& tracer,
                                const FormFactorSettings& settings, const Progress& progress = {});

}  // namespace rebounce
