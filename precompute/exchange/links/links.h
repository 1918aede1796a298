#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/refined_links.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/patch_geometry.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce {

struct LinkBuild : EscapedLight {
  std::shared_ptr<const LinkedFormFactors> form_factors;
  ClosureReport closure;
  std::uint64_t ray_count = 0;        ///< including the rays that measure what escapes
  std::uint64_t candidate_count = 0;  ///< pairs of nodes that were examined
};

/// Computes the form factors as links between nodes of a tree of patches. The number of links and
/// the work grow about with n instead of n² (notes/concepts/links.md). The links are scaled so that
/// rows add up to 1 minus what escapes; reciprocity holds. The bits do not depend on the number of
/// threads.
class LinkBuilder {
 public:
  /// `tracer` holds the first surface_count triangles of model.mesh; both must outlive the object.
  /// Throws Error if a setting is out of range.
  LinkBuilder(const PatchModel& model, const RayTracer& tracer, const FormFactorSettings& settings);

  // Its parts refer to each other.
  LinkBuilder(const LinkBuilder&) = delete;
  LinkBuilder& operator=(const LinkBuilder&) = delete;

  /// Finds the links for `epsilon`, in place of settings.link_epsilon; those that exchange no light
  /// are left out. When called again, links that are near enough stay, so that it takes a part of
  /// the time. Throws Error if epsilon is not above 0 or not below the last one, Cancelled if
  /// `progress` asks to stop.
  LinkBuild build(double epsilon, const Progress& progress = {});

  /// Memory that is kept for finer links.
  std::uint64_t held_bytes() const { return links_.held_bytes(); }

 private:
  LinkedNodes nodes(const std::vector<double>& factor) const;

  const PatchModel& model_;
  const PatchGeometry geometry_;
  const ShadowRays shadow_rays_;
  RefinedLinks links_;
  double epsilon_ = 0;  ///< of the last links
};

}  // namespace rebounce
