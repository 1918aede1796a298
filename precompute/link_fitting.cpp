#include "rebounce/precompute/link_fitting.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "affine_links.h"
#include "cluster_tree.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Eigen::Vector3d;

// Nodes that pairs are sorted by before blocks are worked on apart from each other.
constexpr std::uint32_t kStrips = 48, kSmallestStrip = 64;

/// The exchange area of the patches at two positions of the tree's order, row <= column.
struct Pair {
  std::uint32_t row, column;
  float exchange;
};

/// The pairs of two nodes, added up.
struct Moments {
  double exchange = 0;                                            ///< m²
  Vector3d a = Vector3d::Zero(), b = Vector3d::Zero();  ///< with the place from the nodes' centres
  double square = 0;  ///< of the entries of the symmetric form
};

class LinkFitting {
 public:
  LinkFitting(const ClusterTree& tree, std::vector<NodeSpread> nodes, double epsilon)
      : tree_(tree), nodes_(std::move(nodes)), allowed_(epsilon * epsilon) {
    choose_strips();
  }

  std::vector<AffineLink> fit(const ExchangeMatrix& exchange) {
    sort_pairs(exchange);
    const std::size_t count = strips_.size();
    std::vector<std::vector<AffineLink>> found(count * count);
#pragma omp parallel for schedule(dynamic, 1)
    for (std::size_t k = 0; k < found.size(); ++k) {
      const auto pairs =
          std::span(pairs_).subspan(pairs_begin_[k], pairs_begin_[k + 1] - pairs_begin_[k]);
      fit_block(strips_[k / count], strips_[k % count], pairs, found[k]);
    }
    std::vector<AffineLink> links;
    for (const auto& of_block : found) links.insert(links.end(), of_block.begin(), of_block.end());
    return links;
  }

 private:
  /// The nodes that are small enough, and whose parents are not. No link is between larger ones.
  void choose_strips() {
    const auto n = static_cast<std::uint32_t>(tree_.patch.size());
    const std::uint32_t most = std::max(kSmallestStrip, n / kStrips);
    strip_at_.resize(n);
    std::vector<std::uint32_t> waiting = {0};
    while (!waiting.empty()) {
      const std::uint32_t node = waiting.back();
      waiting.pop_back();
      const Cluster& cluster = tree_.clusters[node];
      if (cluster.count > most) {
        waiting.push_back(cluster.first_child + 1);
        waiting.push_back(cluster.first_child);
        continue;
      }
      std::fill_n(strip_at_.begin() + cluster.begin, cluster.count,
                  static_cast<std::uint32_t>(strips_.size()));
      strips_.push_back(node);
    }
  }

  /// Pairs by positions, those of two strips together.
  void sort_pairs(const ExchangeMatrix& exchange) {
    std::vector<std::uint32_t> position(tree_.patch.size());
    for (std::uint32_t k = 0; k < position.size(); ++k) position[tree_.patch[k]] = k;
    const auto block_of = [&](std::uint32_t row, std::uint32_t column) {
      return strip_at_[row] * strips_.size() + strip_at_[column];
    };
    const auto for_each_pair = [&](const auto& visit) {
      for (std::uint32_t i = 0; i < position.size(); ++i) {
        for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
          const std::uint32_t p = position[i], q = position[exchange.column[k]];
          visit(std::min(p, q), std::max(p, q), exchange.exchange_area[k]);
        }
      }
    };
    pairs_begin_.assign(strips_.size() * strips_.size() + 1, 0);
    for_each_pair([&](std::uint32_t row, std::uint32_t column, float) {
      ++pairs_begin_[block_of(row, column) + 1];
    });
    for (std::size_t k = 1; k < pairs_begin_.size(); ++k) pairs_begin_[k] += pairs_begin_[k - 1];
    pairs_.resize(pairs_begin_.back());
    std::vector<std::uint64_t> next(pairs_begin_.begin(), pairs_begin_.end() - 1);
    for_each_pair([&](std::uint32_t row, std::uint32_t column, float area) {
      pairs_[next[block_of(row, column)]++] = {row, column, area};
    });
  }

  /// Which of two nodes is split: the larger, if it can be.
  bool splits_first(std::uint32_t a, std::uint32_t b) const {
    if (tree_.clusters[a].is_leaf()) return false;
    return tree_.clusters[b].is_leaf() || nodes_[a].area > nodes_[b].area;
  }

  /// Appends the links of the pairs of two nodes, a before b or the same.
  Moments fit_block(std::uint32_t a, std::uint32_t b, std::span<Pair> pairs,
                    std::vector<AffineLink>& links) const {
    if (pairs.empty()) return {};
    if (tree_.clusters[a].is_leaf() && tree_.clusters[b].is_leaf()) {
      const double exchange = pairs.front().exchange;
      links.push_back({.a = a, .b = b, .exchange = exchange});
      return {.exchange = exchange,
              .square = exchange * exchange / (nodes_[a].area * nodes_[b].area)};
    }
    const std::size_t first = links.size();
    if (a == b) {
      fit_diagonal(a, pairs, links);
      return {};
    }
    const bool split_a = splits_first(a, b);
    const std::uint32_t child = tree_.clusters[split_a ? a : b].first_child;
    const auto rest = std::partition(pairs.begin(), pairs.end(), [&](const Pair& pair) {
      return (split_a ? pair.row : pair.column) < tree_.clusters[child + 1].begin;
    });
    const std::array parts = {std::span(pairs.begin(), rest), std::span(rest, pairs.end())};
    Moments sum;
    for (std::uint32_t k = 0; k < 2; ++k) {
      const std::uint32_t part = child + k;
      const Moments moments = split_a ? fit_block(part, b, parts[k], links)
                                      : fit_block(a, part, parts[k], links);
      add(moments, part, split_a, sum);
    }
    if (links.size() > first + 1 && is_affine(a, b, sum) && is_covered(a, b, pairs)) {
      links.resize(first);
      links.push_back(fitted(a, b, sum));
    }
    return sum;
  }

  /// The same of the pairs within a node, which no link to itself stands for.
  void fit_diagonal(std::uint32_t node, std::span<Pair> pairs,
                    std::vector<AffineLink>& links) const {
    const std::uint32_t child = tree_.clusters[node].first_child;
    const std::uint32_t middle = tree_.clusters[child + 1].begin;
    const auto second = std::partition(pairs.begin(), pairs.end(),
                                       [&](const Pair& pair) { return pair.row < middle; });
    const auto across = std::partition(pairs.begin(), second,
                                       [&](const Pair& pair) { return pair.column < middle; });
    fit_block(child, child, std::span(pairs.begin(), across), links);
    fit_block(child, child + 1, std::span(across, second), links);
    fit_block(child + 1, child + 1, std::span(second, pairs.end()), links);
  }

  /// Adds the moments of a child, `part`, of the first or of the second node.
  void add(const Moments& moments, std::uint32_t part, bool is_first, Moments& sum) const {
    const Vector3d moved =
        moments.exchange * (nodes_[part].center - nodes_[nodes_[part].parent].center);
    sum.exchange += moments.exchange;
    sum.square += moments.square;
    sum.a += moments.a;
    sum.b += moments.b;
    (is_first ? sum.a : sum.b) += moved;
  }

  /// The least squares.
  AffineLink fitted(std::uint32_t a, std::uint32_t b, const Moments& sum) const {
    return {.a = a,
            .b = b,
            .exchange = sum.exchange,
            .gradient_a = nodes_[a].inverse * sum.a,
            .gradient_b = nodes_[b].inverse * sum.b};
  }

  bool is_affine(std::uint32_t a, std::uint32_t b, const Moments& sum) const {
    return sum.square - squared_norm(fitted(a, b, sum), nodes_[a], nodes_[b]) < allowed_;
  }

  /// Every patch of either node sees something of the other: a link takes no light to where none
  /// arrives, behind a wall.
  bool is_covered(std::uint32_t a, std::uint32_t b, std::span<const Pair> pairs) const {
    const Cluster &first = tree_.clusters[a], &second = tree_.clusters[b];
    std::vector<char> sees(first.count + second.count, 0);
    for (const Pair& pair : pairs) {
      sees[pair.row - first.begin] = 1;
      sees[first.count + pair.column - second.begin] = 1;
    }
    return std::ranges::find(sees, 0) == sees.end();
  }

  const ClusterTree& tree_;
  const std::vector<NodeSpread> nodes_;
  const double allowed_;
  std::vector<std::uint32_t> strips_;       ///< nodes, in the order of their positions
  std::vector<std::uint32_t> strip_at_;     ///< [n] at each position
  std::vector<std::uint64_t> pairs_begin_;  ///< of strips a and b, at a times their number + b
  std::vector<Pair> pairs_;
};

std::vector<float> row_sums_of_pairs(const ExchangeMatrix& exchange,
                                     const std::vector<float>& area) {
  std::vector<double> sum(area.size());
  for (std::uint32_t i = 0; i < area.size(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = exchange.column[k];
      const double value = exchange.exchange_area[k];
      sum[i] += value / area[i];
      if (j != i) sum[j] += value / area[j];
    }
  }
  return {sum.begin(), sum.end()};
}

}  // namespace

FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches,
                          double epsilon) {
  check_link_error(epsilon);
  if (exchange.patch_count() != patches.size()) {
    throw Error("links: form factors and patches differ in number");
  }
  FormFactorLinks links;
  if (patches.size() == 0) return links;
  const ClusterTree tree = build_cluster_tree(patches, 1, 1);
  links.patch = tree.patch;
  for (const Cluster& cluster : tree.clusters) {
    links.first_child.push_back(cluster.first_child);
    links.count.push_back(cluster.count);
  }
  links.scale.assign(patches.size(), 1);
  LinkFitting fitting(tree, spread_nodes(links, patches.area, patches.centroid), epsilon);
  for (const AffineLink& link : fitting.fit(exchange)) append_link(link, links);
  scale_rows(row_sums_of_pairs(exchange, patches.area), patches.area, patches.centroid, links);
  return links;
}

}  // namespace rebounce
