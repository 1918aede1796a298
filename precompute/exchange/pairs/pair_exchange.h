#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/closure.h"
#include "precompute/exchange/pairs/form_factor_settings.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// A row that is off is traced again with this multiple of the probe rays, which miss some partly
/// covered pairs (lab/005).
inline constexpr int kRefinedProbes = 4;

/// Finds the exchange of pairs of patches, as their shadow rays and the counts of their hemisphere
/// rays tell together. Immutable, usable from any number of threads, each with its own scratch.
class PairExchange {
 public:
  struct Scratch {
    std::vector<FacingPatch> mixed, large_mixed;
    std::vector<Ray> rays;
    std::vector<float> transmitted;  ///< by ray
    std::uint64_t ray_count = 0;     ///< that were traced
  };

  /// All arguments but the values of the settings must outlive the object.
  PairExchange(const ShadowRays& shadow_rays, const RayTracer& tracer,
               const CountedExchange& counted, const FormFactorSettings& settings)
      : shadow_rays_(shadow_rays),
        geometry_(shadow_rays.geometry()),
        tracer_(tracer),
        counted_(counted),
        full_rays_(settings.full_rays) {}

  /// Adds the pairs of patch i with `facing`, none of them coarse, to a row; those without light
  /// are left out, and the order may change. Each gets `probe` shadow rays. If they agree with each
  /// other and with the hemisphere rays, that is the answer. Otherwise it gets all of its rays,
  /// more if it exchanges much. If those do not agree either, the answer is the mean of shadow rays
  /// and hemisphere rays, weighted by the inverse of their variances.
  void measure(std::uint32_t i, const std::vector<FacingPatch>& facing, int probe, Scratch& scratch,
               std::vector<ExchangeEntry>& row) const;

  /// Adds a near pair of many triangles, of which hemisphere rays alone tell.
  void count_coarse(std::uint32_t i, std::uint32_t j, std::uint32_t count,
                    std::vector<ExchangeEntry>& row) const;

 private:
  bool is_contradicted(std::uint32_t i, const FacingPatch& pair, ShadowRays::Agreement agreement,
                       double deviations) const;
  void append_mixed(std::uint32_t i, std::span<const FacingPatch> pairs, int full, Scratch& scratch,
                    std::vector<ExchangeEntry>& row) const;
  void append_traced(std::uint32_t i, std::span<const FacingPatch> pairs, int full,
                     Scratch& scratch, std::vector<ExchangeEntry>& row) const;
  void append_mean(std::uint32_t i, const FacingPatch& pair, const ShadowRays::Visibility& visible,
                   std::vector<ExchangeEntry>& row) const;
  void trace(Scratch& scratch) const;

  const ShadowRays& shadow_rays_;
  const PatchGeometry& geometry_;
  const RayTracer& tracer_;
  const CountedExchange& counted_;
  int full_rays_;
};

}  // namespace rebounce
