#include "precompute/exchange/links/refined_links.h"

#include "precompute/exchange/links/link_scaling.h"

namespace rebounce {
namespace {

// Row sums of links are off by about 1 % because links average penumbrae; scaling corrects this. A
// row that is off by more misses light or has light that is hidden (lab/014).
constexpr double kLinkRowSumTolerance = 0.02;

std::vector<Escape> measure_escapes(const PatchModel& model, const RayTracer& tracer,
                                    const FormFactorSettings& settings) {
  const PatchTriangles triangles(model.mesh.triangle_patch, model.patches.size());
  std::vector<Escape> escape(model.patches.size());
#pragma omp parallel
  {
    EscapeScratch scratch;
#pragma omp for schedule(dynamic, 16)
    for (std::uint32_t i = 0; i < escape.size(); ++i) {
      escape[i] = measure_escape(model.mesh, model.shown_patch, triangles[i], i, tracer,
                                 settings.hemisphere_rays, settings.seed, scratch);
    }
  }
  return escape;
}

}  // namespace

RefinedLinks refine_links(const PatchModel& model, const ShadowRays& shadow_rays,
                          const RayTracer& tracer, const FormFactorSettings& settings,
                          std::span<const float> weight, const Progress& progress) {
  RefinedLinks result{LinkTree(model, shadow_rays.geometry(), weight), {}, {}, {}, 0, 0};
  LinkRefinement refinement(result.tree, shadow_rays, tracer, settings);
  refinement.run(part_of(progress, 0.0, 0.5));
  result.escape = measure_escapes(model, tracer, settings);
  result.target = row_sum_targets(result.escape, settings.hemisphere_rays);
  const std::vector<double> ones(model.patches.size(), 1.0);
  const std::vector<double> sum = gather_links(result.tree, refinement.links(), ones);
  refinement.revise(find_doubtful_rows(sum, result.target, kLinkRowSumTolerance),
                    part_of(progress, 0.5, 1.0));
  result.links.assign(refinement.links().begin(), refinement.links().end());
  result.ray_count = refinement.ray_count();
  result.candidate_count = refinement.candidate_count();
  return result;
}

}  // namespace rebounce
