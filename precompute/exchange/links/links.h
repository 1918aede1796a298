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

struct LinkBuild : EscapedLight {
  FormFactorLinks links;
  ClosureReport closure;
  std::uint64_t ray_count = 0;        ///< including the rays that measure what escapes
  std::uint64_t candidate_count = 0;  ///< pairs of nodes that were examined
};

/// Computes the form factors as links between nodes of a tree of patches. The number of links and
/// the work grow about with n instead of n² (notes/concepts/links.md). The links are scaled so that
/// rows add up to 1 minus what escapes; reciprocity holds.
///
/// `tracer` holds the first surface_count triangles of model.mesh. settings.link_epsilon must be
/// above 0. `weight` [n] >= 0 is the weight of errors in the light from each patch, for instance
/// its radiosity divided by the mean ("BF refinement"); empty: 1. The bits do not depend on the
/// number of threads. Throws Error if a setting is out of range, Cancelled if `progress` asks to
/// stop.
LinkBuild build_links(const PatchModel& model, const RayTracer& tracer,
                      const FormFactorSettings& settings, std::span<const float> weight = {},
                      const Progress& progress = {});

}  // namespace rebounce
