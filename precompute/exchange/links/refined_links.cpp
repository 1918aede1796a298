#include "precompute/exchange/links/refined_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/base/parallel_progress.h"
#include "precompute/exchange/links/leaf_links.h"
#include "precompute/exchange/links/link_scaling.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

// Row sums of links are off by about 1 % because links average penumbrae; scaling corrects this. A
// row that is off by more misses light or has light that is hidden (lab/014).
constexpr double kLinkRowSumTolerance = 0.02;

// The noise of the coarse links of a patch, together, is at most so many epsilon: as the errors of
// its other links are together (lab/123). Noise falls with the inverse of this root of the number
// of rays (lab/007), which grows to this multiple at most.
constexpr double kCoarseNoise = 10, kRaysOfNoise = 1.6, kMostHemispheres = 32;

/// The settings with the probe rays that rows of pairs get where they are off: what probe rays miss
/// of links is 0.2 % of the light (lab/117).
FormFactorSettings with_more_probes(FormFactorSettings settings) {
  settings.probe_rays = std::min(LinkRays::kMostRays, kRefinedProbes * settings.probe_rays);
  return settings;
}

/// Finds what escapes, and what links between single patches exchange.
class LinkMeasurement {
 public:
  LinkMeasurement(const PatchModel& model, const ShadowRays& shadow_rays, const RayTracer& tracer,
                  const FormFactorSettings& settings)
      : model_(model),
        shadow_rays_(shadow_rays),
        geometry_(shadow_rays.geometry()),
        tracer_(tracer),
        settings_(settings),
        triangles_(model.mesh.triangle_patch, model.patches.size()) {}

  /// Measures `links`, and returns the escape of all patches.
  std::vector<Escape> run(LeafLinks& links, const Progress& progress) {
    std::vector<Escape> escape(model_.patches.size());
    measure(links, std::vector<bool>(escape.size(), true), escape, progress);
    return escape;
  }

  /// Measures `links`, with the same rays.
  void revise(LeafLinks& links, const Progress& progress) {
    std::vector<Escape> escape(model_.patches.size());
    std::vector<bool> involved;
    for (std::uint32_t i = 0; i < escape.size(); ++i) involved.push_back(links.involves(i));
    measure(links, involved, escape, progress);
  }

  std::uint64_t ray_count() const { return ray_count_; }

 private:
  void measure(LeafLinks& links, const std::vector<bool>& wanted, std::vector<Escape>& escape,
               const Progress& progress) {
    std::vector<double> rays(escape.size(), settings_.hemisphere_rays), more(rays.size(), 0.0);
    for (std::size_t i = 0; i < rays.size(); ++i) more[i] = wanted[i] ? rays[i] : 0;
    trace_hemispheres(more, settings_.seed, links, escape, part_of(progress, 0.0, 0.3));
    more = further_rays(links, CountedExchange(geometry_.areas(), rays));
    trace_hemispheres(more, mix_bits(settings_.seed), links, escape, part_of(progress, 0.3, 0.6));
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] += more[i];
    const CountedExchange counted(geometry_.areas(), std::move(rays));
    const PairExchange exchange(shadow_rays_, tracer_, counted, settings_);
    ray_count_ +=
        links.measure(geometry_, exchange, settings_.probe_rays, part_of(progress, 0.6, 1.0));
  }

  /// Rays that leave each patch beside the first ones, so that what its coarse links exchange is
  /// known as well as what other links do.
  std::vector<double> further_rays(const LeafLinks& links, const CountedExchange& counted) const {
    std::vector<double> more = links.counted_variance(geometry_, counted);
    const double allowed = kCoarseNoise * settings_.link_epsilon;
    for (double& m : more) {
      const double times = std::pow(std::sqrt(m) / allowed, kRaysOfNoise);
      m = times > 1 ? (std::min(std::ceil(times), kMostHemispheres) - 1) * settings_.hemisphere_rays
                    : 0;
    }
    return more;
  }

  /// Traces `count` [n] rays. Where there are any, what escapes is taken from them.
  void trace_hemispheres(std::span<const double> count, std::uint64_t seed, LeafLinks& links,
                         std::vector<Escape>& escape, const Progress& progress) {
    const std::size_t n = escape.size();
    ParallelProgress loop(progress, n);
#pragma omp parallel
    {
      EscapeScratch scratch;
      MetPatchCounter counter;
#pragma omp for schedule(dynamic, 16)
      for (std::uint32_t i = 0; i < n; ++i) {
        if (loop.stopped() || count[i] == 0) continue;
        escape[i] = measure_escape(model_.mesh, model_.shown_patch, triangles_[i], i, tracer_,
                                   static_cast<int>(count[i]), seed, scratch);
        links.count(i, counter.count(n, scratch.met));
        loop.advance();
      }
    }
    loop.finish();
    for (const double c : count) ray_count_ += static_cast<std::uint64_t>(c);
  }

  const PatchModel& model_;
  const ShadowRays& shadow_rays_;
  const PatchGeometry& geometry_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  const PatchTriangles triangles_;
  std::uint64_t ray_count_ = 0;
};

}  // namespace

RefinedLinks refine_links(const PatchModel& model, const ShadowRays& shadow_rays,
                          const RayTracer& tracer, const FormFactorSettings& of_pairs,
                          std::span<const float> weight, const Progress& progress) {
  RefinedLinks result{LinkTree(model, shadow_rays.geometry(), weight), {}, {}, {}, 0, 0};
  const FormFactorSettings settings = with_more_probes(of_pairs);
  LinkRefinement refinement(result.tree, shadow_rays, tracer, settings);
  LinkMeasurement measurement(model, shadow_rays, tracer, settings);
  refinement.run(part_of(progress, 0.0, 0.4));
  LeafLinks links(result.tree, refinement.links());
  result.escape = measurement.run(links, part_of(progress, 0.4, 0.5));
  result.target = row_sum_targets(result.escape, settings.hemisphere_rays);
  const std::vector<double> ones(model.patches.size(), 1.0);
  const std::vector<double> sum = gather_links(result.tree, refinement.links(), ones);
  const std::size_t kept = refinement.revise(
      find_doubtful_rows(sum, result.target, kLinkRowSumTolerance), part_of(progress, 0.5, 0.9));
  LeafLinks revised(result.tree, refinement.links().subspan(kept));
  if (!revised.empty()) measurement.revise(revised, part_of(progress, 0.9, 1.0));
  result.links = refinement.take_links();
  result.ray_count = refinement.ray_count() + measurement.ray_count();
  result.candidate_count = refinement.candidate_count();
  return result;
}

}  // namespace rebounce
