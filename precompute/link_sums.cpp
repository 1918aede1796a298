#include "link_sums.h"

#include <algorithm>
#include <cmath>

#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

constexpr int kScalingSteps = 30;  // each about halves what is left
constexpr double kScaled = 1e-6;   // row sums nearer to their targets than this are there
constexpr double kLeastFactor = 0.5, kGreatestFactor = 2;

// Relative deviation of a row sum that links amount to, from penumbrae that they average; measured.
constexpr double kSumDeviation = 0.01;

/// A sum over a node, and its first moment about the node's centre.
struct Moments {
  double sum = 0;
  glm::dvec3 first{0};
};

}  // namespace

std::vector<double> gather_links(const LinkTree& tree, std::span<const Link> links,
                                 std::span<const double> x) {
  const auto nodes = tree.nodes();
  std::vector<Moments> mean(nodes.size()), arrived(nodes.size());
  for (std::size_t k = nodes.size(); k-- > 0;) {
    const LinkNode& node = nodes[k];
    if (node.is_leaf()) {
      mean[k].sum = x[tree.leaf_patch(node)];
      continue;
    }
    for (std::uint32_t c = node.first_child; c < node.first_child + 2; ++c) {
      const double part = nodes[c].area / node.area;
      mean[k].sum += part * mean[c].sum;
      mean[k].first += part * (mean[c].first + mean[c].sum * (nodes[c].center - node.center));
    }
  }
  const auto add = [&](std::uint32_t to, std::uint32_t from, double exchange,
                       const Float3& gradient_to, const Float3& gradient_from) {
    arrived[to].sum +=
        exchange * mean[from].sum + glm::dot(to_dvec3(gradient_from), mean[from].first);
    arrived[to].first += mean[from].sum * to_dvec3(gradient_to);
  };
  for (const Link& link : links) {
    add(link.a, link.b, link.exchange_area, link.gradient_a, link.gradient_b);
    if (link.a == link.b) continue;
    add(link.b, link.a, link.exchange_area, link.gradient_b, link.gradient_a);
  }
  std::vector<double> out(x.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const LinkNode& node = nodes[k];
    if (node.is_leaf()) {
      const std::uint32_t patch = tree.leaf_patch(node);
      out[patch] = arrived[k].sum / node.area;
      continue;
    }
    for (std::uint32_t c = node.first_child; c < node.first_child + 2; ++c) {
      const double part = nodes[c].area / node.area;
      arrived[c].sum +=
          part * (arrived[k].sum + glm::dot(arrived[k].first, nodes[c].center - node.center));
      arrived[c].first += part * arrived[k].first;
    }
  }
  return out;
}

std::vector<double> scale_links(const LinkTree& tree, std::span<const Link> links,
                                std::span<const RowTarget> target) {
  std::vector<double> factor(target.size(), 1.0), wanted(target.size());
  std::vector<double> sum = gather_links(tree, links, factor);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double variance = kSumDeviation * kSumDeviation,
                 uncertain = target[i].deviation * target[i].deviation;
    wanted[i] = sum[i] + variance / (variance + uncertain) * (target[i].sum - sum[i]);
  }
  for (int step = 0; step < kScalingSteps; ++step) {
    double worst = 0;
    for (std::size_t i = 0; i < factor.size(); ++i) {
      const double row = factor[i] * sum[i];
      worst = std::max(worst, std::abs(row - wanted[i]));
      if (row <= 0 || wanted[i] <= 0) continue;
      factor[i] = std::clamp(factor[i] * std::sqrt(wanted[i] / row), kLeastFactor, kGreatestFactor);
    }
    if (worst < kScaled) break;
    sum = gather_links(tree, links, factor);
  }
  return factor;
}

}  // namespace rebounce
