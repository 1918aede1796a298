
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/links/link_scaling.h"
#include "rebounce/error.h"

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

/// The settings, once they are checked.
const FormFactorSettings& checked(const FormFactorSettings& settings) {
  check_form_factor_settings(settings);
  return settings;
}

}  // namespace

LinkBuilder::LinkBuilder(const PatchModel& model, const RayTracer& tracer,
                         const FormFactorSettings& settings)
    : geometry_(model, tracer),
      shadow_rays_(geometry_, settings.seed, settings.kernel_tolerance),
      links_(model, shadow_rays_, tracer, checked(settings)) {}

LinkBuild LinkBuilder::build(double epsilon, const Progress& progress) {
  if (!(epsilon > 0)) throw Error("links: link_epsilon must be above 0");
  if (epsilon_ > 0 && !(epsilon < epsilon_)) throw Error("links: epsilon must become smaller");
  epsilon_ = epsilon;
  links_.refine(epsilon, progress);
  LinkBuild build;
  const LinkScaling scaling = scale_links(links_.tree(), links_.links(), links_.target());
  copy_tree(links_.tree(), build.links);
  copy_links(links_.links(), build.links);
  build.links.scale.assign(scaling.factor.begin(), scaling.factor.end());
  build.closure = scaling.closure;
  static_cast<EscapedLight&>(build) = share_escape(scaling.row_sum, links_.escape());
  build.ray_count = links_.ray_count();
  build.candidate_count = links_.candidate_count();
  return build;
}

}  // namespace rebounce
