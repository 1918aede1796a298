#include "rebounce/precompute/link_coarsening.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "affine_links.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Eigen::Vector3d;

/// A link and the square of what merging has cost so far.
struct WideLink : AffineLink {
  double lost = 0;
  bool gone = false;
};

class Coarsening {
 public:
  Coarsening(const FormFactorLinks& links, std::vector<NodeSpread> nodes, double epsilon)
      : nodes_(std::move(nodes)), allowed_(epsilon * epsilon) {
    for (std::size_t l = 0; l < links.pair.size(); ++l) {
      const auto& g = links.gradient[l];
      insert({{.a = links.pair[l][0],
               .b = links.pair[l][1],
               .exchange = links.exchange_area[l],
               .gradient_a = {g[0], g[1], g[2]},
               .gradient_b = {g[3], g[4], g[5]}}});
    }
  }

  /// What is merged comes after all that was there, and is looked at in its turn.
  void run() {
    for (std::size_t l = 0; l < links_.size(); ++l) merge_if_near(l);
  }

  void store(FormFactorLinks& links) const {
    links.pair.clear();
    links.exchange_area.clear();
    links.gradient.clear();
    for (const WideLink& link : links_) {
      if (!link.gone) append_link(link, links);
    }
  }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }

  void insert(const WideLink& link) {
    index_[key(link.a, link.b)] = links_.size();
    links_.push_back(link);
  }

  const WideLink* find(std::uint32_t a, std::uint32_t b) const {
    const auto found = index_.find(key(a, b));
    return found == index_.end() || links_[found->second].gone ? nullptr : &links_[found->second];
  }

  /// `link` with `node` as its b.
  static WideLink turned(const WideLink& link, std::uint32_t node) {
    WideLink result = link;
    if (link.b != node) {
      std::swap(result.a, result.b);
      std::swap(result.gradient_a, result.gradient_b);
    }
    return result;
  }

  void merge_if_near(std::size_t l) {
    if (links_[l].gone || links_[l].a == links_[l].b) return;
    WideLink best;
    best.lost = allowed_;
    std::uint32_t gathered = kNone;
    for (const std::uint32_t node : {links_[l].a, links_[l].b}) {
      const WideLink merged = with_sibling(turned(links_[l], node));
      if (!(merged.lost < best.lost)) continue;
      best = merged;
      gathered = node;
    }
    if (gathered == kNone) return;
    const WideLink* other = find(best.a, nodes_[gathered].sibling);
    links_[l].gone = true;
    links_[static_cast<std::size_t>(other - links_.data())].gone = true;
    insert(best);
  }

  /// One link for `link` and that of its a to the sibling of its b; all is lost if there is none.
  WideLink with_sibling(const WideLink& link) const {
    WideLink merged;
    merged.lost = allowed_;
    const NodeSpread& node = nodes_[link.b];
    const WideLink* found = node.parent == kNone ? nullptr : find(link.a, node.sibling);
    if (found == nullptr || found->a == found->b) return merged;
    const WideLink other = turned(*found, node.sibling);
    const NodeSpread &a = nodes_[link.a], &parent = nodes_[node.parent];
    merged.a = link.a;
    merged.b = node.parent;
    merged.exchange = link.exchange + other.exchange;
    merged.gradient_a = link.gradient_a + other.gradient_a;
    // Of the kernel with the place in b, both times the areas of a and of the parent.
    Vector3d product = Vector3d::Zero();
    for (const WideLink* part : {&link, &other}) {
      const NodeSpread& child = nodes_[part->b];
      product +=
          part->exchange * (child.center - parent.center) + child.covariance * part->gradient_b;
    }
    merged.gradient_b = parent.inverse * product;
    const double before =
        squared_norm(link, a, node) + squared_norm(other, a, nodes_[node.sibling]);
    const double change = std::max(0.0, before - squared_norm(merged, a, parent));
    merged.lost = link.lost + other.lost + change;
    return merged;
  }

  const std::vector<NodeSpread> nodes_;
  const double allowed_;
  std::vector<WideLink> links_;
  std::unordered_map<std::uint64_t, std::size_t> index_;
};

}  // namespace

FormFactorLinks coarsen_links(const FormFactorLinks& links, std::span<const float> area,
                              std::span<const Float3> centroid, double epsilon) {
  if (!(epsilon >= 0) || !std::isfinite(epsilon)) {
    throw Error("links: the error of coarser ones must be finite and not negative");
  }
  const std::vector<float> target = row_sums(links, area, centroid);
  Coarsening coarsening(links, spread_nodes(links, area, centroid), epsilon);
  coarsening.run();
  FormFactorLinks result = links;
  coarsening.store(result);
  scale_rows(target, area, centroid, result);
  return result;
}

}  // namespace rebounce
