#include "precompute/exchange/links/refined_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/base/parallel_progress.h"
#include "precompute/exchange/links/hidden_links.h"
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
constexpr double kCoarseNoise = 10, kRaysOfNoise = 1.6, kMostHemispheres = 16;

// Pairs of each generation that a forecast looks at: its deviation is some 5 % (lab/123).
constexpr std::size_t kForecastPairs = 4096;

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

  /// Adds links between single patches that hemisphere rays join although shadow rays between
  /// nodes found them hidden, and measures these.
  void add_seen(LinkRefinement& refinement, const LinkTree& tree, const Progress& progress) {
    const HiddenLinks hidden(tree, refinement.links());
    if (hidden.empty()) return;
    const std::size_t n = model_.patches.size();
    const std::vector<double> rays(n, settings_.hemisphere_rays);
    std::vector<std::vector<MetPatch>> seen(n);
    trace_hemispheres(rays, settings_.seed, part_of(progress, 0.0, 0.5),
                      [&](std::uint32_t i, const Escape&, std::span<const MetPatch> met) {
                        seen[i] = hidden.seen(i, met);
                      });
    Ranks().share(std::span(seen));
    std::vector<std::pair<std::uint32_t, std::uint32_t>> leaves;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (const MetPatch& m : seen[i]) {
        leaves.push_back(std::minmax({hidden.leaf(i), hidden.leaf(m.patch)}));
      }
    }
    std::ranges::sort(leaves);
    leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
    const std::size_t known = refinement.add(leaves);
    LeafLinks added(tree, refinement.links().subspan(known));
    for (std::uint32_t i = 0; i < n; ++i) added.count(i, seen[i]);
    measure(added, rays, part_of(progress, 0.5, 1.0));
  }

  std::uint64_t ray_count() const { return ray_count_; }

 private:
  /// Measures `links` from what `rays` [n] of each patch have counted.
  void measure(LeafLinks& links, std::vector<double> rays, const Progress& progress) {
    const CountedExchange counted(geometry_.areas(), std::move(rays));
    const PairExchange exchange(shadow_rays_, tracer_, counted, settings_);
    ray_count_ += links.measure(geometry_, exchange, settings_.probe_rays, progress);
  }

  void measure(LeafLinks& links, const std::vector<bool>& wanted, std::vector<Escape>& escape,
               const Progress& progress) {
    std::vector<double> rays(escape.size(), settings_.hemisphere_rays), more(rays.size(), 0.0);
    for (std::size_t i = 0; i < rays.size(); ++i) more[i] = wanted[i] ? rays[i] : 0;
    const auto keep = [&](std::uint32_t i, const Escape& of_patch, std::span<const MetPatch> met) {
      escape[i] = of_patch;
      links.count(i, met);
    };
    const Ranks ranks;
    trace_hemispheres(more, settings_.seed, part_of(progress, 0.0, 0.3), keep);
    links.add_up_counts(ranks);
    more = further_rays(links, CountedExchange(geometry_.areas(), rays));
    trace_hemispheres(more, mix_bits(settings_.seed), part_of(progress, 0.3, 0.6), keep);
    links.add_up_counts(ranks);
    share(ranks, escape);
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] += more[i];
    measure(links, std::move(rays), part_of(progress, 0.6, 1.0));
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

  /// Traces `count` [n] rays of each patch. `keep`(i, escape, met) is called where there are any,
  /// from several threads.
  template <typename Keep>
  void trace_hemispheres(std::span<const double> count, std::uint64_t seed,
                         const Progress& progress, const Keep& keep) {
    const std::size_t n = count.size();
    const Ranks ranks;
    ParallelProgress loop(progress, n);
#pragma omp parallel
    {
      EscapeScratch scratch;
      MetPatchCounter counter;
#pragma omp for schedule(dynamic, 16)
      for (std::uint32_t i = 0; i < n; ++i) {
        if (loop.stopped() || count[i] == 0 || !ranks.makes(i)) continue;
        const Escape escape = measure_escape(model_.mesh, model_.shown_patch, triangles_[i], i,
                                             tracer_, static_cast<int>(count[i]), seed, scratch);
        keep(i, escape, counter.count(n, scratch.met));
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
      find_doubtful_rows(sum, result.target, kLinkRowSumTolerance), part_of(progress, 0.5, 0.8));
  LeafLinks revised(result.tree, refinement.links().subspan(kept));
  if (!revised.empty()) measurement.revise(revised, part_of(progress, 0.8, 0.9));
  measurement.add_seen(refinement, result.tree, part_of(progress, 0.9, 1.0));
  result.links = refinement.take_links();
  result.ray_count = refinement.ray_count() + measurement.ray_count();
  result.candidate_count = refinement.candidate_count();
  return result;
}

std::size_t forecast_link_count(const PatchModel& model, const RayTracer& tracer,
                                const FormFactorSettings& settings, const Progress& progress) {
  const PatchGeometry geometry(model, tracer);
  const ShadowRays shadow_rays(geometry, settings.seed, settings.kernel_tolerance);
  const LinkTree tree(model, geometry, {});
  LinkRefinement refinement(tree, shadow_rays, tracer, with_more_probes(settings));
  return static_cast<std::size_t>(refinement.forecast(kForecastPairs, progress));
}

}  // namespace rebounce
