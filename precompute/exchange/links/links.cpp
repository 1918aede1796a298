
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/links/link_scaling.h"
#include "precompute/exchange/links/refined_links.h"
#include "rebounce/error.h"
#include "transfer/base/bfloat16.h"

namespace rebounce {
namespace {

void copy_tree(const LinkTree& tree, FormFactorLinks& links) {
  links.patch.assign(tree.patches().begin(), tree.patches().end());
  for (const LinkNode& node : tree.nodes()) {
    links.first_child.push_back(node.first_child);
    links.count.push_back(node.count);
  }
}

/// Leaves out pairs that are hidden from each other.
void copy_links(std::span<const Link> from, FormFactorLinks& links) {
  for (const Link& link : from) {
    if (link.exchange_area <= 0) continue;
    const Float3 &g = link.gradient_a, &h = link.gradient_b;
    links.pair.push_back({link.a, link.b});
    links.exchange_area.push_back(link.exchange_area);
    links.gradient.push_back({g[0], g[1], g[2], h[0], h[1], h[2]});
  }
}

/// Rounds gradients to the precision that LinkedFormFactors stores, before rows are added up:
/// everything that is made from the links then uses the same F.
void round_gradients(std::span<Link> links) {
  for (Link& link : links) {
    for (float& g : link.gradient_a) g = round_to_bfloat16(g);
    for (float& g : link.gradient_b) g = round_to_bfloat16(g);
  }
}

}  // namespace

LinkBuild build_links(const PatchModel& model, const RayTracer& tracer,
                      const FormFactorSettings& settings, std::span<const float> weight,
                      const Progress& progress) {
  check_form_factor_settings(settings);
  if (!(settings.link_epsilon > 0)) throw Error("links: link_epsilon must be above 0");
  if (!weight.empty() && weight.size() != model.patches.size()) {
    throw Error("links: weights and patches differ in number");
  }
  const PatchGeometry geometry(model, tracer);
  const ShadowRays shadow_rays(geometry, settings.seed, settings.kernel_tolerance);
  RefinedLinks refined = refine_links(model, shadow_rays, tracer, settings, weight, progress);
  round_gradients(refined.links);
  LinkBuild build;
  const LinkScaling scaling = scale_links(refined.tree, refined.links, refined.target);
  copy_tree(refined.tree, build.links);
  copy_links(refined.links, build.links);
  build.links.scale.assign(scaling.factor.begin(), scaling.factor.end());
  build.closure = scaling.closure;
  static_cast<EscapedLight&>(build) = share_escape(scaling.row_sum, refined.escape);
  build.ray_count = refined.ray_count;
  build.candidate_count = refined.candidate_count;
  return build;
}

}  // namespace rebounce
