#include "precompute/exchange/links/affine_links.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace rebounce {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A node has no gradient in directions in which it extends by less than this fraction of its size.
// Such a gradient would be as large as the direction is thin. Gradients are stored as bfloat16,
// axis by axis, so rounding errors point anywhere, also along the length of the node: they are at
// most 2^-9 / 0.03 of what the gradient stands for. With 1e-6 gathering diverges (lab/016).
constexpr double kFlatSpread = 0.03;
constexpr int kScalingRounds = 4;

// Factors stay within these limits. A patch that sees almost nothing may have lost most of it;
// factors that compensate would amplify the light between two such patches without end.
constexpr float kLeastScale = 0.5F, kMostScale = 2;

Matrix3d inverse_without_flat(const Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance);
  const double least = kFlatSpread * kFlatSpread * eigen.eigenvalues()[2];
  Matrix3d inverse = Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > least)) continue;
    const Vector3d axis = eigen.eigenvectors().col(k);
    inverse += axis * axis.transpose() / value;
  }
  return inverse;
}

}  // namespace

void share(const Ranks& ranks, std::span<std::vector<AffineLink>> lists) {
  if (ranks.alone()) return;
  struct Plain {
    std::uint32_t a, b;
    std::array<double, 7> values;
  };
  std::vector<std::vector<Plain>> plain(lists.size());
  for (std::size_t k = 0; k < lists.size(); ++k) {
    for (const AffineLink& link : lists[k]) {
      const Vector3d &g = link.gradient_a, &h = link.gradient_b;
      plain[k].push_back({link.a, link.b, {link.exchange, g[0], g[1], g[2], h[0], h[1], h[2]}});
    }
  }
  ranks.share(std::span(plain));
  for (std::size_t k = 0; k < lists.size(); ++k) {
    lists[k].clear();
    for (const auto& [a, b, v] : plain[k]) {
      lists[k].push_back({a, b, v[0], {v[1], v[2], v[3]}, {v[4], v[5], v[6]}});
    }
  }
}

std::vector<NodeSpread> spread_nodes(const LinkedNodes& tree, std::span<const float> area,
                                     std::span<const Float3> centroid) {
  const std::size_t m = tree.first_child.size();
  std::vector<NodeSpread> nodes(m);
  const std::vector<std::uint32_t> begin = first_positions(tree);
  for (std::size_t k = m; k-- > 0;) {
    NodeSpread& node = nodes[k];
    const std::uint32_t child = tree.first_child[k];
    if (child == kNone) {
      const std::uint32_t patch = tree.patch[begin[k]];
      node.area = area[patch];
      for (int axis = 0; axis < 3; ++axis) {
        node.center[axis] = centroid[patch][static_cast<std::size_t>(axis)];
      }
      continue;
    }
    const NodeSpread &a = nodes[child], &b = nodes[child + 1];
    node.area = a.area + b.area;
    node.center = (a.area * a.center + b.area * b.center) / node.area;
    for (const NodeSpread* part : {&a, &b}) {
      const Vector3d d = part->center - node.center;
      node.covariance += part->area / node.area * (part->covariance + d * d.transpose());
    }
    node.inverse = inverse_without_flat(node.covariance);
  }
  return nodes;
}

double squared_norm(const AffineLink& link, const NodeSpread& a, const NodeSpread& b) {
  return (link.exchange * link.exchange + link.gradient_a.dot(a.covariance * link.gradient_a) +
          link.gradient_b.dot(b.covariance * link.gradient_b)) /
         (a.area * b.area);
}

void append_link(const AffineLink& link, FormFactorLinks& links) {
  links.pair.push_back({link.a, link.b});
  links.exchange_area.push_back(static_cast<float>(link.exchange));
  std::array<float, 6>& gradient = links.gradient.emplace_back();
  for (int axis = 0; axis < 3; ++axis) {
    gradient[static_cast<std::size_t>(axis)] = static_cast<float>(link.gradient_a[axis]);
    gradient[static_cast<std::size_t>(axis) + 3] = static_cast<float>(link.gradient_b[axis]);
  }
}

AffineLink affine_link(std::uint32_t to, const IncomingLink& link) {
  const Float3 a = to_floats(link.gradient_to), b = to_floats(link.gradient_from);
  return {.a = to,
          .b = link.from,
          .exchange = link.exchange_area,
          .gradient_a = {a[0], a[1], a[2]},
          .gradient_b = {b[0], b[1], b[2]}};
}

std::vector<float> row_sums(const LinkedFormFactors& links) {
  std::vector<float> sums;
  sums.reserve(links.patch_count());
  for (const Float3& sum : gather(links, std::vector<Float3>(links.patch_count(), {1, 1, 1}))) {
    sums.push_back(sum[0]);
  }
  return sums;
}

void scale_rows(std::span<const float> target, std::span<const float> area,
                std::span<const Float3> centroid, FormFactorLinks& links) {
  for (std::size_t i = 0; i < target.size(); ++i) {
    if (target[i] == 0) links.scale[i] = 0;
  }
  std::vector<float> scaled(target.size(), 1);  // with the factors of this function
  for (int round = 0; round < kScalingRounds; ++round) {
    const std::vector<float> sum = row_sums(LinkedFormFactors(links, area, centroid));
    for (std::size_t i = 0; i < sum.size(); ++i) {
      if (!(sum[i] > 0 && target[i] > 0)) continue;
      const float wanted = scaled[i] * std::sqrt(target[i] / sum[i]);
      const float allowed = std::clamp(wanted, kLeastScale, kMostScale);
      links.scale[i] *= allowed / std::exchange(scaled[i], allowed);
    }
  }
}

}  // namespace rebounce
