#include "precompute/exchange/links/link_scaling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "precompute/base/parallel_loop.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr int kScalingSteps = 30;  // each step about halves the rest
constexpr double kScaled = 1e-6;   // a row sum this near to its target is scaled
constexpr double kLeastFactor = 0.8, kGreatestFactor = 1.25;

// The same where links between patches with nothing between them stay. Where more than that would
// be needed, as in nooks, these are what is off.
constexpr double kLeastOfRest = 0.9, kGreatestOfRest = 1.1;

// Least factor of patches that see almost nothing: their exchange has leaked through nodes on both
// sides of a wall and may be removed.
constexpr double kLeastFactorUnseeing = 1e-6;

// Relative deviation of the row sum of links, and of that of links between nodes alone, from
// penumbrae that links average (lab/014).
constexpr double kSumDeviation = 0.01;

// Pieces of the links that threads share.
constexpr std::size_t kPieces = 8;

/// A sum over a node, and its first moment about the centre of the node.
struct Moments {
  double sum = 0;
  glm::dvec3 first{0};
};

bool sees_almost_nothing(const RowSumTarget& target) {
  return target.sum <= 3 * target.deviation;
}

/// Limits of the factor of a patch.
struct Limits {
  double least, greatest, least_unseeing;

  double clamp(double factor, const RowSumTarget& target) const {
    return std::clamp(factor, sees_almost_nothing(target) ? least_unseeing : least, greatest);
  }
};
constexpr Limits kOfRest{kLeastOfRest, kGreatestOfRest, kLeastOfRest},
    kOfAll{kLeastFactor, kGreatestFactor, kLeastFactorUnseeing};

/// The mean of `x` over each node.
std::vector<Moments> pull(const LinkTree& tree, std::span<const double> x) {
  const auto nodes = tree.nodes();
  std::vector<Moments> mean(nodes.size());
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
  return mean;
}

/// The light that arrives at each node along some links.
std::vector<Moments> gather_along(std::span<const Link> links, const std::vector<Moments>& mean) {
  std::vector<Moments> arrived(mean.size());
  const auto add = [&](std::uint32_t to, std::uint32_t from, double exchange,
                       const BFloat16x3& gradient_to, const BFloat16x3& gradient_from) {
    arrived[to].sum +=
        exchange * mean[from].sum + glm::dot(to_dvec3(to_floats(gradient_from)), mean[from].first);
    arrived[to].first += mean[from].sum * to_dvec3(to_floats(gradient_to));
  };
  for (const Link& link : links) {
    const Link::OfNodes of_nodes = link.of_nodes();
    add(link.a(), link.b(), link.exchange_area, of_nodes.gradient_a, of_nodes.gradient_b);
    if (link.a() == link.b()) continue;
    add(link.b(), link.a(), link.exchange_area, of_nodes.gradient_b, of_nodes.gradient_a);
  }
  return arrived;
}

/// The light that arrives at each node along its links. Threads share pieces of the links, whose
/// sums are added in order.
std::vector<Moments> gather_nodes(const std::vector<Moments>& mean, std::span<const Link> links) {
  std::array<std::vector<Moments>, kPieces> piece;
  parallel_loop(kPieces, [&](std::size_t p) {
    const std::size_t begin = p * links.size() / kPieces, end = (p + 1) * links.size() / kPieces;
    piece[p] = gather_along(links.subspan(begin, end - begin), mean);
  });
  std::vector<Moments>& arrived = piece[0];
  parallel_loop(
      arrived.size(), 1 << 12, [] { return 0; },
      [&](std::size_t node, int) {
        for (std::size_t p = 1; p < kPieces; ++p) {
          arrived[node].sum += piece[p][node].sum;
          arrived[node].first += piece[p][node].first;
        }
      });
  return std::move(arrived);
}

/// The light that arrives at each of `patch_count` patches, summed over all nodes that contain it.
std::vector<double> push(const LinkTree& tree, std::vector<Moments> arrived,
                         std::size_t patch_count) {
  const auto nodes = tree.nodes();
  std::vector<double> out(patch_count);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const LinkNode& node = nodes[k];
    if (node.is_leaf()) {
      out[tree.leaf_patch(node)] = arrived[k].sum / node.area;
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

/// The targets, moved towards the present sums by their uncertainty.
std::vector<double> wanted_sums(std::span<const double> sum, std::span<const RowSumTarget> target) {
  std::vector<double> wanted(sum.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double variance = kSumDeviation * kSumDeviation,
                 uncertain = target[i].deviation * target[i].deviation;
    wanted[i] = sum[i] + variance / (variance + uncertain) * (target[i].sum - sum[i]);
  }
  return wanted;
}

/// Patches that see nothing only exchange leaked light, of either sign. Scaling by sums cannot
/// remove it, so the factor of such a patch is 0.
std::vector<double> first_factors(std::span<const RowSumTarget> target) {
  std::vector<double> factor;
  for (const RowSumTarget& t : target) factor.push_back(t.sum > 0 ? 1 : 0);
  return factor;
}

std::vector<double> scaled_row_sums(const LinkTree& tree, std::span<const Link> links,
                                    const std::vector<double>& factor) {
  std::vector<double> sum = gather_links(tree, links, factor);
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] *= factor[i];
  return sum;
}

/// Changes the factors until the rows of `links` add up to `wanted` [n], as far as their limits
/// allow.
void scale_to(const LinkTree& tree, std::span<const Link> links, std::span<const double> wanted,
              std::span<const RowSumTarget> target, const Limits& limits,
              std::vector<double>& factor) {
  for (int step = 0; step < kScalingSteps; ++step) {
    const std::vector<double> row = scaled_row_sums(tree, links, factor);
    double worst = 0;
    for (std::size_t i = 0; i < factor.size(); ++i) {
      if (factor[i] == 0) continue;
      worst = std::max(worst, std::abs(row[i] - wanted[i]));
      if (row[i] <= 0 || wanted[i] <= 0) continue;
      factor[i] = limits.clamp(factor[i] * std::sqrt(wanted[i] / row[i]), target[i]);
    }
    if (worst < kScaled) break;
  }
}

/// True for two patches with nothing between them.
bool is_certain(const Link& link) {
  return link.joins_patches() && link.exchange_area == link.unoccluded_area;
}

/// The two patches of a link between patches, ascending.
std::pair<std::uint32_t, std::uint32_t> row_and_column(const LinkTree& tree, const Link& link) {
  return std::minmax({tree.leaf_patch(tree[link.a()]), tree.leaf_patch(tree[link.b()])});
}

/// What the links between two patches add to each row.
std::vector<double> leaf_sums(const LinkTree& tree, std::span<const Link> links,
                              std::size_t patch_count) {
  std::vector<double> sum(patch_count, 0.0);
  for (const Link& link : links) {
    if (!link.joins_patches()) continue;
    const LinkNode &a = tree[link.a()], &b = tree[link.b()];
    sum[tree.leaf_patch(a)] += link.exchange_area / a.area;
    if (link.a() != link.b()) sum[tree.leaf_patch(b)] += link.exchange_area / b.area;
  }
  return sum;
}

/// The links between patches whose variance is known, sorted by their rows and columns.
std::vector<std::uint32_t> yielding_links(const LinkTree& tree, std::span<const Link> links) {
  std::vector<std::uint32_t> yielding;
  for (std::uint32_t l = 0; l < links.size(); ++l) {
    if (links[l].of_patches().variance > 0 && links[l].exchange_area > 0) yielding.push_back(l);
  }
  std::ranges::sort(yielding, {}, [&](std::uint32_t l) { return row_and_column(tree, links[l]); });
  return yielding;
}

/// Lets links between patches give way, each in proportion to its variance, as pairs do
/// (enforce_closure), until rows add up to `wanted` [n] as nearly as links between nodes are
/// certain. `sum` [n]: the present sums of the rows, `of_nodes`: of links between nodes alone.
void close_leaves(const LinkTree& tree, std::span<Link> links, std::span<const double> wanted,
                  std::span<const double> sum, std::span<const double> of_nodes,
                  std::span<const RowSumTarget> target) {
  std::vector<double> area(sum.size());
  for (const LinkNode& node : tree.nodes()) {
    if (node.is_leaf()) area[tree.leaf_patch(node)] = node.area;
  }
  const std::vector<std::uint32_t> yielding = yielding_links(tree, links);
  ExchangeRows rows(sum.size());
  for (const std::uint32_t l : yielding) {
    const auto [i, j] = row_and_column(tree, links[l]);
    const double most = links[l].unoccluded_area,
                 part = links[l].of_patches().variance / (most * most);
    rows[i].push_back(
        {j, links[l].exchange_area, links[l].unoccluded_area, static_cast<float>(part)});
  }
  const std::vector<double> held = row_sums(rows, area);
  std::vector<RowSumTarget> wanted_of_rows;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double rest = wanted[i] - (sum[i] - held[i]);
    wanted_of_rows.push_back(
        {std::max(0.0, rest), std::hypot(target[i].deviation, kSumDeviation * of_nodes[i])});
  }
  enforce_closure(rows, area, wanted_of_rows);
  std::vector<std::size_t> next(rows.size(), 0);
  for (const std::uint32_t l : yielding) {
    const std::uint32_t i = row_and_column(tree, links[l]).first;
    links[l].exchange_area = rows[i][next[i]++].exchange_area;
  }
}

/// Divides links between patches by their factors, except where these are 0.
void divide(const LinkTree& tree, std::span<const double> factor, std::span<Link> links) {
  const auto of = [&](std::uint32_t leaf) {
    const double f = factor[tree.leaf_patch(tree[leaf])];
    return f > 0 ? f : 1;
  };
  for (Link& link : links) link.exchange_area /= static_cast<float>(of(link.a()) * of(link.b()));
}

/// The squared change of the exchange by factors, and its squared norm, Frobenius.
struct Change {
  double change = 0, norm = 0;

  /// Each link counts as equal for all of its pairs.
  void add(const LinkTree& tree, std::span<const Link> links, std::span<const double> factor) {
    const auto nodes = tree.nodes();
    std::vector<double> mean(nodes.size(), 0.0);
    for (std::size_t k = nodes.size(); k-- > 0;) {
      const LinkNode& node = nodes[k];
      if (node.is_leaf()) {
        mean[k] = factor[tree.leaf_patch(node)];
        continue;
      }
      for (std::uint32_t c = node.first_child; c < node.first_child + 2; ++c) {
        mean[k] += nodes[c].count * mean[c] / node.count;
      }
    }
    for (const Link& link : links) {
      const double pairs = static_cast<double>(nodes[link.a()].count) * nodes[link.b()].count;
      const double squared = static_cast<double>(link.exchange_area) * link.exchange_area / pairs;
      const double part = mean[link.a()] * mean[link.b()] - 1;
      change += squared * part * part;
      norm += squared;
    }
  }
};

}  // namespace

std::vector<double> gather_links(const LinkTree& tree, std::span<const Link> links,
                                 std::span<const double> x) {
  return push(tree, gather_nodes(pull(tree, x), links), x.size());
}

LinkScaling scale_links(const LinkTree& tree, std::span<Link> links,
                        std::span<const RowSumTarget> target) {
  LinkScaling result;
  std::vector<double>&factor = result.factor, &row = result.row_sum;
  const auto middle = std::partition(links.begin(), links.end(), is_certain);
  const auto certain_count = static_cast<std::size_t>(middle - links.begin());
  const std::span certain = links.first(certain_count), rest = links.subspan(certain_count);
  row = gather_links(tree, links, std::vector<double>(target.size(), 1.0));
  result.closure.row_sum_error_before = largest_row_error(row, target, /*certain=*/false);
  factor = first_factors(target);
  const std::vector<double> wanted = wanted_sums(scaled_row_sums(tree, links, factor), target);
  std::vector<double> of_nodes = leaf_sums(tree, links, row.size());
  for (std::size_t i = 0; i < row.size(); ++i) of_nodes[i] = std::max(0.0, row[i] - of_nodes[i]);
  close_leaves(tree, rest, wanted, scaled_row_sums(tree, links, factor), of_nodes, target);

  std::vector<double> of_rest = wanted;
  const std::vector<double> held = scaled_row_sums(tree, certain, factor);
  for (std::size_t i = 0; i < held.size(); ++i) of_rest[i] -= held[i];
  scale_to(tree, rest, of_rest, target, kOfRest, factor);
  divide(tree, factor, certain);
  std::vector<double> change = factor;
  scale_to(tree, links, wanted, target, kOfAll, factor);
  row = scaled_row_sums(tree, links, factor);
  result.closure.row_sum_error_after = largest_row_error(row, target, /*certain=*/true);

  Change squared;
  squared.add(tree, rest, factor);
  for (std::size_t i = 0; i < change.size(); ++i) {
    if (change[i] > 0) change[i] = factor[i] / change[i];
  }
  squared.add(tree, certain, change);
  if (squared.norm > 0) result.closure.relative_change = std::sqrt(squared.change / squared.norm);
  return result;
}

}  // namespace rebounce
