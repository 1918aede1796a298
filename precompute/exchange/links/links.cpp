#include "precompute/exchange/links/links.h"

#include <algorithm>
#include <functional>
#include <utility>

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

std::size_t LinkBuilder::find(double epsilon, const Progress& progress) {
  if (!(epsilon > 0)) throw Error("links: link_epsilon must be above 0");
  if (epsilon_ > 0 && !(epsilon < epsilon_)) throw Error("links: epsilon must become smaller");
  epsilon_ = epsilon;
  links_.refine(epsilon, progress);
  LinkScaling scaling = scale_links(links_.tree(), links_.links(), links_.target());
  factor_ = std::move(scaling.factor);
  closure_ = scaling.closure;
  escaped_ = share_escape(scaling.row_sum, links_.escape());
  return link_count();
}

/// The tree of the links, and the scales of patches.
FormFactorLinks LinkBuilder::tree() const {
  FormFactorLinks tree;
  tree.patch.assign(links_.tree().patches().begin(), links_.tree().patches().end());
  for (const LinkNode& node : links_.tree().nodes()) {
    tree.first_child.push_back(node.first_child);
    tree.count.push_back(node.count);
  }
  tree.scale.assign(factor_.begin(), factor_.end());
  return tree;
}

LinkBuild LinkBuilder::result() const {
  LinkBuild build;
  static_cast<EscapedLight&>(build) = escaped_;
  build.closure = closure_;
  build.ray_count = links_.ray_count();
  build.candidate_count = links_.candidate_count();
  build.links = tree();
  const std::size_t count = link_count();
  build.links.pair.reserve(count);
  build.links.exchange_area.reserve(count);
  build.links.gradient.reserve(count);
  for (const Link& link : links_.links()) {
    if (!exchanges(link)) continue;
    const Float3 g = to_floats(link.gradient_a), h = to_floats(link.gradient_b);
    build.links.pair.push_back({link.a, link.b});
    build.links.exchange_area.push_back(link.exchange_area);
    build.links.gradient.push_back({g[0], g[1], g[2], h[0], h[1], h[2]});
  }
  return build;
}

/// Of links that exchange light.
std::size_t LinkBuilder::link_count() const {
  return static_cast<std::size_t>(std::ranges::count_if(links_.links(), exchanges));
}

std::shared_ptr<const LinkedFormFactors> LinkBuilder::form_factors() const {
  const GiveLinks give = [&](const std::function<void(const NodeLink&)>& take) {
    for (const Link& link : links_.links()) {
      if (!exchanges(link)) continue;
      take({link.a, link.b, link.exchange_area, link.gradient_a, link.gradient_b});
    }
  };
  const PatchTable& patches = model_.patches;
  return std::make_shared<const LinkedFormFactors>(tree(), give, patches.area, patches.centroid);
}

}  // namespace rebounce
