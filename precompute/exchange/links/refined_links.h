#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/hemisphere_counts.h"
#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/row_sum_targets.h"
#include "precompute/exchange/pairs/shadow_rays.h"

namespace rebounce {

/// Links of a whole scene after refinement and one revision where rows do not add up.
class RefinedLinks {
 public:
  /// All arguments must outlive the object.
  RefinedLinks(const PatchModel& model, const ShadowRays& shadow_rays, const RayTracer& tracer,
               const FormFactorSettings& settings);

  /// Refines links to `epsilon`, measures what escapes and those between single patches, and
  /// revises the links of patches whose row sum disagrees. When called again, `epsilon` must be
  /// smaller, and what is near enough stays. Throws Cancelled if asked to stop.
  void refine(double epsilon, const Progress& progress);

  const LinkTree& tree() const { return tree_; }
  /// Closure may change the exchange areas.
  std::span<Link> links() { return refinement_.links(); }
  std::span<const Link> links() const { return refinement_.links(); }
  std::span<const Escape> escape() const { return hemispheres_.escape(); }  ///< [n]
  /// Of row sums [n].
  std::span<const RowSumTarget> target() const { return target_; }
  /// In all.
  std::uint64_t ray_count() const;
  std::uint64_t candidate_count() const { return refinement_.candidate_count(); }
  /// Memory that links, and what rays have met, take from one call of refine() to the next.
  std::uint64_t held_bytes() const { return refinement_.held_bytes() + hemispheres_.held_bytes(); }

 private:
  void measure(double epsilon, const Progress& progress);
  void add_seen();

  const ShadowRays& shadow_rays_;
  const RayTracer& tracer_;
  const FormFactorSettings settings_;
  const LinkTree tree_;
  LinkRefinement refinement_;
  HemisphereCounts hemispheres_;
  std::vector<RowSumTarget> target_;
  std::uint64_t measuring_rays_ = 0;
};

/// Forecasts the number of links of a scene that exchange light, from a sample. Throws Cancelled if
/// asked to stop.
std::size_t forecast_link_count(const PatchModel& model, const RayTracer& tracer,
                                const FormFactorSettings& settings, const Progress& progress = {});

}  // namespace rebounce
