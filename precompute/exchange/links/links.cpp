#include "precompute/exchange/links/links.h"

#include <functional>

#include "precompute/exchange/links/link_scaling.h"
#include "rebounce/error.h"

namespace rebounce {
namespace {

/// Two nodes that are not hidden from each other.
bool exchanges(const Link& link) {
  return link.exchange_area > 0;
}

/// The settings, once they are checked.
const FormFactorSettings& checked(const FormFactorSettings& settings) {
  check_form_factor_settings(settings);
  return settings;
}

}  // namespace

LinkBuilder::LinkBuilder(const PatchModel& model, const RayTracer& tracer,
                         const FormFactorSettings& settings)
    : model_(model),
      geometry_(model, tracer),
      shadow_rays_(geometry_, settings.seed, settings.kernel_tolerance),
      links_(model, shadow_rays_, tracer, checked(settings)) {}

/// The tree of the links, and the scales of patches: their factors [n].
LinkedNodes LinkBuilder::nodes(const std::vector<double>& factor) const {
  LinkedNodes nodes;
  nodes.patch.assign(links_.tree().patches().begin(), links_.tree().patches().end());
  for (const LinkNode& node : links_.tree().nodes()) {
    nodes.first_child.push_back(node.first_child);
    nodes.count.push_back(node.count);
  }
  nodes.scale.assign(factor.begin(), factor.end());
  return nodes;
}

LinkBuild LinkBuilder::build(double epsilon, const Progress& progress) {
  if (!(epsilon > 0)) throw Error("links: link_epsilon must be above 0");
  if (epsilon_ > 0 && !(epsilon < epsilon_)) throw Error("links: epsilon must become smaller");
  epsilon_ = epsilon;
  links_.refine(epsilon, progress);
  const LinkScaling scaling = scale_links(links_.tree(), links_.links(), links_.target());
  LinkBuild build;
  static_cast<EscapedLight&>(build) = share_escape(scaling.row_sum, links_.escape());
  const GiveLinks give = [&](const std::function<void(const NodeLink&)>& take) {
    for (const Link& link : links_.links()) {
      if (!exchanges(link)) continue;
      const Link::OfNodes of_nodes = link.of_nodes();
      take({link.a(), link.b(), link.exchange_area, of_nodes.gradient_a, of_nodes.gradient_b});
    }
  };
  build.form_factors = std::make_shared<const LinkedFormFactors>(
      nodes(scaling.factor), give, model_.patches.area, model_.patches.centroid);
  build.closure = scaling.closure;
  build.ray_count = links_.ray_count();
  build.candidate_count = links_.candidate_count();
  return build;
}

}  // namespace rebounce
