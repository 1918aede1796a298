#include "rebounce/precompute/link_coarsening.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Directions in which a node extends by less than this part of its size have no gradient.
constexpr double kFlat = 1e-6;
constexpr int kScalingRounds = 4;

/// A node of the tree and how its patches' centroids are spread, by area.
struct Node {
  std::uint32_t parent = kNone, sibling = kNone;
  double area = 0;
  Vector3d center = Vector3d::Zero();
  Matrix3d covariance = Matrix3d::Zero();
  Matrix3d inverse = Matrix3d::Zero();  ///< of the covariance, without flat directions
};

struct WideLink {
  std::uint32_t a = 0, b = 0;
  double exchange = 0;
  Vector3d gradient_a = Vector3d::Zero(), gradient_b = Vector3d::Zero();
  double lost = 0;  ///< square of what merging has cost so far
  bool gone = false;
};

Matrix3d inverse_without_flat(const Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance);
  const double least = kFlat * kFlat * eigen.eigenvalues()[2];
  Matrix3d inverse = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > least)) continue;
    const Vector3d axis = eigen.eigenvectors().col(k);
    inverse += axis * axis.transpose() / value;
  }
  return inverse;
}

std::vector<Node> make_nodes(const FormFactorLinks& links, std::span<const float> area,
                             std::span<const Float3> centroid) {
  const std::size_t m = links.first_child.size();
  std::vector<Node> nodes(m);
  const std::vector<std::uint32_t> begin = first_positions(links);
  for (std::uint32_t k = 0; k < m; ++k) {
    const std::uint32_t child = links.first_child[k];
    if (child == kNone) continue;
    nodes[child].parent = nodes[child + 1].parent = k;
    nodes[child].sibling = child + 1;
    nodes[child + 1].sibling = child;
  }
  for (std::size_t k = m; k-- > 0;) {
    Node& node = nodes[k];
    const std::uint32_t child = links.first_child[k];
    if (child == kNone) {
      const std::uint32_t patch = links.patch[begin[k]];
      node.area = area[patch];
      for (int axis = 0; axis < 3; ++axis) {
        node.center[axis] = centroid[patch][static_cast<std::size_t>(axis)];
      }
      continue;
    }
    const Node &a = nodes[child], &b = nodes[child + 1];
    node.area = a.area + b.area;
    node.center = (a.area * a.center + b.area * b.center) / node.area;
    for (const Node* part : {&a, &b}) {
      const Vector3d d = part->center - node.center;
      node.covariance += part->area / node.area * (part->covariance + d * d.transpose());
    }
    node.inverse = inverse_without_flat(node.covariance);
  }
  return nodes;
}

class Coarsening {
 public:
  Coarsening(const FormFactorLinks& links, std::vector<Node> nodes, double epsilon)
      : nodes_(std::move(nodes)), allowed_(epsilon * epsilon) {
    for (std::size_t l = 0; l < links.pair.size(); ++l) {
      const auto& g = links.gradient[l];
      insert({.a = links.pair[l][0],
              .b = links.pair[l][1],
              .exchange = links.exchange_area[l],
              .gradient_a = {g[0], g[1], g[2]},
              .gradient_b = {g[3], g[4], g[5]}});
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
      if (link.gone) continue;
      links.pair.push_back({link.a, link.b});
      links.exchange_area.push_back(static_cast<float>(link.exchange));
      std::array<float, 6>& gradient = links.gradient.emplace_back();
      for (int axis = 0; axis < 3; ++axis) {
        gradient[static_cast<std::size_t>(axis)] = static_cast<float>(link.gradient_a[axis]);
        gradient[static_cast<std::size_t>(axis) + 3] = static_cast<float>(link.gradient_b[axis]);
      }
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
    const Node& node = nodes_[link.b];
    const WideLink* found = node.parent == kNone ? nullptr : find(link.a, node.sibling);
    if (found == nullptr || found->a == found->b) return merged;
    const WideLink other = turned(*found, node.sibling);
    const Node &a = nodes_[link.a], &parent = nodes_[node.parent];
    merged.a = link.a;
    merged.b = node.parent;
    merged.exchange = link.exchange + other.exchange;
    merged.gradient_a = link.gradient_a + other.gradient_a;
    // Of the kernel with the place in b, both times the areas of a and of the parent.
    Vector3d product = Vector3d::Zero();
    for (const WideLink* part : {&link, &other}) {
      const Node& child = nodes_[part->b];
      product +=
          part->exchange * (child.center - parent.center) + child.covariance * part->gradient_b;
    }
    merged.gradient_b = parent.inverse * product;
    const double before = square(link, a, node) + square(other, a, nodes_[node.sibling]);
    const double change = std::max(0.0, before - square(merged, a, parent));
    merged.lost = link.lost + other.lost + change;
    return merged;
  }

  /// Frobenius norm of the part of the symmetric form, squared.
  static double square(const WideLink& link, const Node& a, const Node& b) {
    return (link.exchange * link.exchange + link.gradient_a.dot(a.covariance * link.gradient_a) +
            link.gradient_b.dot(b.covariance * link.gradient_b)) /
           (a.area * b.area);
  }

  const std::vector<Node> nodes_;
  const double allowed_;
  std::vector<WideLink> links_;
  std::unordered_map<std::uint64_t, std::size_t> index_;
};

std::vector<Float3> row_sums(const FormFactorLinks& links, std::span<const float> area,
                             std::span<const Float3> centroid) {
  return gather(LinkedFormFactors(links, area, centroid),
                std::vector<Float3>(area.size(), {1, 1, 1}));
}

}  // namespace

FormFactorLinks coarsen_links(const FormFactorLinks& links, std::span<const float> area,
                              std::span<const Float3> centroid, double epsilon) {
  if (!(epsilon >= 0) || !std::isfinite(epsilon)) {
    throw Error("links: the error of coarser ones must be finite and not negative");
  }
  const std::vector<Float3> target = row_sums(links, area, centroid);
  Coarsening coarsening(links, make_nodes(links, area, centroid), epsilon);
  coarsening.run();
  FormFactorLinks result = links;
  coarsening.store(result);
  for (int round = 0; round < kScalingRounds; ++round) {
    const std::vector<Float3> sum = row_sums(result, area, centroid);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      if (sum[i][0] > 0 && target[i][0] > 0) {
        result.scale[i] *= std::sqrt(target[i][0] / sum[i][0]);
      }
    }
  }
  return result;
}

}  // namespace rebounce
