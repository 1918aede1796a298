#include "precompute/exchange/links/refined_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "precompute/exchange/links/hidden_links.h"
#include "precompute/exchange/links/leaf_links.h"
#include "precompute/exchange/links/link_scaling.h"

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

/// Rays that leave each patch beside the first ones, so that what its coarse links exchange is
/// known as well as what other links do. `rays` [n] are those that have left the patches; the first
/// of each were `first_rays`.
std::vector<double> further_rays(const LeafLinks& links, const CountedExchange& counted,
                                 double epsilon, std::span<const double> rays, int first_rays) {
  std::vector<double> more = links.counted_variance(counted);
  for (std::size_t i = 0; i < more.size(); ++i) {
    const double noise = std::sqrt(more[i]) / (kCoarseNoise * epsilon);
    const double hemispheres = std::ceil(std::pow(noise, kRaysOfNoise) * rays[i] / first_rays);
    more[i] = noise > 1 ? (std::min(hemispheres, kMostHemispheres) - 1) * first_rays : 0;
  }
  return more;
}

}  // namespace

RefinedLinks::RefinedLinks(const PatchModel& model, const ShadowRays& shadow_rays,
                           const RayTracer& tracer, const FormFactorSettings& settings)
    : shadow_rays_(shadow_rays),
      tracer_(tracer),
      settings_(with_more_probes(settings)),
      tree_(model, shadow_rays.geometry()),
      refinement_(tree_, shadow_rays, tracer, settings_),
      hemispheres_(model, tracer, settings.hemisphere_rays, settings.seed) {}

void RefinedLinks::refine(double epsilon, const Progress& progress) {
  for (Link& link : links()) {
    const float measured = link.of_patches().measured_area;
    if (measured >= 0) link.exchange_area = measured;
  }
  refinement_.refine(epsilon, part_of(progress, 0.0, 0.4));
  if (target_.empty()) {
    hemispheres_.trace(part_of(progress, 0.4, 0.5));
    target_ = row_sum_targets(escape(), settings_.hemisphere_rays);
  }
  measure(epsilon, part_of(progress, 0.5, 0.78));
  const std::vector<double> ones(target_.size(), 1.0);
  refinement_.revise(
      find_doubtful_rows(gather_links(tree_, links(), ones), target_, kLinkRowSumTolerance),
      part_of(progress, 0.78, 0.85));
  add_seen();
  measure(epsilon, part_of(progress, 0.85, 1.0));
}

/// Measures the links between single patches that are new, and what more rays tell of coarse ones.
void RefinedLinks::measure(double epsilon, const Progress& progress) {
  const PatchGeometry& geometry = shadow_rays_.geometry();
  LeafLinks leaves(tree_, geometry, links());
  leaves.count(hemispheres_);
  const CountedExchange first(geometry.areas(), hemispheres_.rays());
  const std::vector<double> more =
      further_rays(leaves, first, epsilon, hemispheres_.rays(), settings_.hemisphere_rays);
  if (hemispheres_.trace_further(more, part_of(progress, 0.0, 0.15))) leaves.count(hemispheres_);
  const CountedExchange counted(geometry.areas(), hemispheres_.rays());
  const PairExchange exchange(shadow_rays_, tracer_, counted, settings_);
  measuring_rays_ += leaves.measure(exchange, settings_.probe_rays, part_of(progress, 0.15, 1.0));
}

/// Adds links between single patches that hemisphere rays join although shadow rays between nodes
/// found them hidden.
void RefinedLinks::add_seen() {
  const HiddenLinks hidden(tree_, links());
  if (hidden.empty()) return;
  std::vector<std::vector<std::uint32_t>> seen(target_.size());
  hemispheres_.for_each_patch([&](std::uint32_t i, std::span<const MetPatch> met) {
    for (const MetPatch& m : hidden.seen(i, met)) seen[i].push_back(m.patch);
  });
  Ranks().share(std::span(seen));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> leaves;
  for (std::uint32_t i = 0; i < seen.size(); ++i) {
    for (const std::uint32_t j : seen[i]) {
      leaves.push_back(std::minmax({hidden.leaf(i), hidden.leaf(j)}));
    }
  }
  std::ranges::sort(leaves);
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  refinement_.add(leaves);
}

std::uint64_t RefinedLinks::ray_count() const {
  return refinement_.ray_count() + measuring_rays_ + hemispheres_.traced_rays();
}

std::size_t forecast_link_count(const PatchModel& model, const RayTracer& tracer,
                                const FormFactorSettings& settings, const Progress& progress) {
  const PatchGeometry geometry(model, tracer);
  const ShadowRays shadow_rays(geometry, settings.seed, settings.kernel_tolerance);
  const LinkTree tree(model, geometry);
  LinkRefinement refinement(tree, shadow_rays, tracer, with_more_probes(settings));
  return static_cast<std::size_t>(
      refinement.forecast(settings.link_epsilon, kForecastPairs, progress));
}

}  // namespace rebounce
