#include "precompute/exchange/links/refined_links.h"

#include <algorithm>

#include "precompute/base/parallel_progress.h"
#include "precompute/exchange/links/leaf_links.h"
#include "precompute/exchange/links/link_scaling.h"

namespace rebounce {
namespace {

// Row sums of links are off by about 1 % because links average penumbrae; scaling corrects this. A
// row that is off by more misses light or has light that is hidden (lab/014).
constexpr double kLinkRowSumTolerance = 0.02;

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
        geometry_(shadow_rays.geometry()),
        tracer_(tracer),
        settings_(settings),
        counted_(geometry_.areas(), settings.hemisphere_rays),
        exchange_(shadow_rays, tracer, counted_, settings) {}

  /// Measures `links`, and returns the escape of all patches.
  std::vector<Escape> run(LeafLinks& links, const Progress& progress) {
    std::vector<Escape> escape = trace_hemispheres(links, part_of(progress, 0.0, 0.5));
    ray_count_ +=
        links.measure(geometry_, exchange_, settings_.probe_rays, part_of(progress, 0.5, 1.0));
    return escape;
  }

  std::uint64_t ray_count() const { return ray_count_; }

 private:
  std::vector<Escape> trace_hemispheres(LeafLinks& links, const Progress& progress) {
    const std::size_t n = model_.patches.size();
    const PatchTriangles triangles(model_.mesh.triangle_patch, n);
    std::vector<Escape> escape(n);
    const Ranks ranks;
    ParallelProgress loop(progress, n);
#pragma omp parallel
    {
      EscapeScratch scratch;
      MetPatchCounter counter;
#pragma omp for schedule(dynamic, 16)
      for (std::uint32_t i = 0; i < n; ++i) {
        if (loop.stopped() || !ranks.makes(i)) continue;
        escape[i] = measure_escape(model_.mesh, model_.shown_patch, triangles[i], i, tracer_,
                                   settings_.hemisphere_rays, settings_.seed, scratch);
        links.count(i, counter.count(n, scratch.met));
        loop.advance();
      }
    }
    loop.finish();
    share(ranks, escape);
    links.add_up_counts(ranks);
    ray_count_ += n * static_cast<std::uint64_t>(settings_.hemisphere_rays);
    return escape;
  }

  const PatchModel& model_;
  const PatchGeometry& geometry_;
  const RayTracer& tracer_;
  const FormFactorSettings& settings_;
  CountedExchange counted_;
  PairExchange exchange_;
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
  // The rays are the same as before, and the counts those of other pairs.
  if (!revised.empty()) measurement.run(revised, part_of(progress, 0.9, 1.0));
  result.links = refinement.take_links();
  result.ray_count = refinement.ray_count() + measurement.ray_count();
  result.candidate_count = refinement.candidate_count();
  return result;
}

}  // namespace rebounce
