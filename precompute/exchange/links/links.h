#pragma once

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

/// Error that a link may have by default: see FormFactorSettings::link_epsilon. Measured:
/// notes/links.md.
inline constexpr double kLinkEpsilon = 5e-4;

struct LinkBuild : EscapedLight {
  FormFactorLinks links;
  ClosureReport closure;
  std::uint64_t ray_count = 0;        ///< with those that measure what escapes
  std::uint64_t candidate_count = 0;  ///< pairs of nodes that were looked at
};

/// Finds the form factors as links between nodes of a tree of patches, their number and the work
/// growing about like n and not like n² (notes/links.md), scaled so that rows add up to what
/// escape leaves of 1, reciprocity untouched.
///
/// `tracer` holds the first surface_count triangles of model.mesh. Of the settings, link_epsilon
/// must be above 0. `weight` [n] >= 0 says what errors in the light from a patch weigh, for
/// instance its radiosity divided by the mean ("BF refinement"); empty: 1. The bits do not depend
/// on the number of threads. Throws Error if a setting is out of range, Cancelled when `progress`
/// says so.
LinkBuild build_links(const PatchModel& model, const RayTracer& tracer,
                      const FormFactorSettings& settings, std::span<const float> weight = {},
                      const Progress& progress = {});

}  // namespace rebounce
