#include "rebounce/precompute/link_fitting.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "affine_links.h"
#include "cluster_tree.h"
#include "disjoint_sets.h"
#include "pair_sums.h"
#include "rebounce/precompute/parallel_progress.h"
#include "rebounce/transfer/error.h"

namespace rebounce {
namespace {

using Eigen::Vector3d;

// Sides of the blocks within which links are chosen, in patches: larger ones are never worth a
// single link in scenes of thousands of patches, and their tables leave the caches.
constexpr std::uint32_t kBlockSide = 256;

// Rooms with groups of their own in the tree; smaller ones share the last.
constexpr std::size_t kRoomGroups = 255;

/// [n] A number for each room: the patches that light can go between, on however long a way.
std::vector<std::uint32_t> find_rooms(const ExchangeMatrix& exchange) {
  const auto n = static_cast<std::uint32_t>(exchange.patch_count());
  DisjointSets sets(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      sets.join(i, exchange.column[k]);
    }
  }
  std::vector<std::uint32_t> room(n);
  for (std::uint32_t i = 0; i < n; ++i) room[i] = sets.find(i);
  return room;
}

/// [n] Groups for the tree, so that its nodes are of one room as far as may be: the largest rooms
/// have one each.
std::vector<std::uint8_t> room_groups(std::span<const std::uint32_t> room) {
  std::vector<std::uint32_t> size(room.size(), 0), rooms;
  for (const std::uint32_t r : room) {
    if (size[r]++ == 0) rooms.push_back(r);
  }
  std::ranges::sort(rooms, [&](std::uint32_t a, std::uint32_t b) {
    return size[a] != size[b] ? size[a] > size[b] : a < b;
  });
  std::vector<std::uint8_t> group_of_room(room.size(), kRoomGroups), group(room.size());
  for (std::size_t k = 0; k < std::min(kRoomGroups, rooms.size()); ++k) {
    group_of_room[rooms[k]] = static_cast<std::uint8_t>(k);
  }
  for (std::size_t i = 0; i < room.size(); ++i) group[i] = group_of_room[room[i]];
  return group;
}

/// A tree over the patches and how its nodes are spread.
struct SpreadTree {
  ClusterTree tree;
  std::vector<NodeSpread> spread;
  std::vector<std::uint32_t> room;  ///< that all patches of a node are in, or kNone

  PositionRange range(std::uint32_t node) const {
    return {tree.clusters[node].begin, tree.clusters[node].count};
  }
};

struct NodePair {
  std::uint32_t a, b;
};

/// A node and all below it, the children of each side by side.
class Subtree {
 public:
  void list(const ClusterTree& tree, std::uint32_t root) {
    node_.assign(1, root);
    child_.clear();
    for (std::size_t k = 0; k < node_.size(); ++k) {
      const Cluster& cluster = tree.clusters[node_[k]];
      child_.push_back(cluster.is_leaf() ? kNone : static_cast<std::uint32_t>(node_.size()));
      if (cluster.is_leaf()) continue;
      node_.push_back(cluster.first_child);
      node_.push_back(cluster.first_child + 1);
    }
  }

  std::size_t size() const { return node_.size(); }
  std::uint32_t node(std::uint32_t k) const { return node_[k]; }
  /// Place of the first child in the list, or kNone.
  std::uint32_t first_child(std::uint32_t k) const { return child_[k]; }

 private:
  std::vector<std::uint32_t> node_, child_;
};

/// Chooses the links of one block after another.
class BlockFitting {
 public:
  BlockFitting(const SpreadTree& tree, const SortedPairs& pairs, const PatchTable& patches,
               double price)
      : tree_(tree), sums_(pairs, patches, tree.tree.patch), price_(price) {}

  /// The links between two nodes of which the first comes before the second.
  std::vector<AffineLink> fit(const NodePair& block) {
    sums_.add_up(tree_.range(block.a), tree_.range(block.b));
    a_.list(tree_.tree, block.a);
    b_.list(tree_.tree, block.b);
    choice_.assign(a_.size() * b_.size(), {});
    cost(0, 0);
    std::vector<AffineLink> links;
    append_chosen(0, 0, links);
    return links;
  }

 private:
  static constexpr double kForbidden = std::numeric_limits<double>::infinity();

  enum class Kind : std::uint8_t { kUnknown, kNothing, kLink, kSplitA, kSplitB };
  struct Choice {
    double cost = 0;  ///< squared error and prices
    Kind kind = Kind::kUnknown;
  };

  Choice& choice(std::uint32_t i, std::uint32_t j) { return choice_[i * b_.size() + j]; }

  PairSums sums(std::uint32_t i, std::uint32_t j) const {
    return sums_.of(tree_.range(a_.node(i)), tree_.range(b_.node(j)));
  }

  AffineLink least_squares(std::uint32_t i, std::uint32_t j, const PairSums& sums) const {
    const std::uint32_t a = a_.node(i), b = b_.node(j);
    const NodeSpread &of_a = tree_.spread[a], &of_b = tree_.spread[b];
    return {.a = a,
            .b = b,
            .exchange = sums.exchange,
            .gradient_a = of_a.inverse * (sums.of_rows - sums.exchange * of_a.center),
            .gradient_b = of_b.inverse * (sums.of_columns - sums.exchange * of_b.center)};
  }

  double squared_error(std::uint32_t i, std::uint32_t j, const PairSums& pairs) const {
    const double norm = squared_norm(least_squares(i, j, pairs), tree_.spread[a_.node(i)],
                                     tree_.spread[b_.node(j)]);
    return std::max(0.0, pairs.squared - norm);
  }

  /// Otherwise a link would take light through a wall.
  bool is_of_one_room(std::uint32_t i, std::uint32_t j) const {
    const std::uint32_t room = tree_.room[a_.node(i)];
    return room != kNone && room == tree_.room[b_.node(j)];
  }

  /// The least that places i and j of the two subtrees can cost.
  double cost(std::uint32_t i, std::uint32_t j) {
    if (choice(i, j).kind == Kind::kUnknown) choice(i, j) = choose(i, j);
    return choice(i, j).cost;
  }

  Choice choose(std::uint32_t i, std::uint32_t j) {
    const PairSums pairs = sums(i, j);
    if (pairs.count == 0) return {0, Kind::kNothing};
    Choice best{kForbidden, Kind::kLink};
    if (is_of_one_room(i, j)) {
      const double error = squared_error(i, j, pairs);
      best.cost = error + price_;
      // A second link costs more than the first could save.
      if (error <= price_) return best;
    }
    if (const std::uint32_t k = a_.first_child(i); k != kNone) {
      const double split = cost(k, j) + cost(k + 1, j);
      if (split < best.cost) best = {split, Kind::kSplitA};
    }
    if (const std::uint32_t k = b_.first_child(j); k != kNone) {
      const double split = cost(i, k) + cost(i, k + 1);
      if (split < best.cost) best = {split, Kind::kSplitB};
    }
    return best;
  }

  void append_chosen(std::uint32_t i, std::uint32_t j, std::vector<AffineLink>& links) {
    const Kind kind = choice(i, j).kind;
    if (kind == Kind::kLink) links.push_back(least_squares(i, j, sums(i, j)));
    if (kind != Kind::kSplitA && kind != Kind::kSplitB) return;
    for (std::uint32_t k = 0; k < 2; ++k) {
      if (kind == Kind::kSplitA) {
        append_chosen(a_.first_child(i) + k, j, links);
      } else {
        append_chosen(i, b_.first_child(j) + k, links);
      }
    }
  }

  const SpreadTree& tree_;
  SummedPairs sums_;
  const double price_;
  Subtree a_, b_;
  std::vector<Choice> choice_;  ///< [a][b]
};

/// Appends the pairs of nodes of at most kBlockSide patches into which the pairs of two nodes, a
/// before b or the same, are cut.
void append_blocks(const ClusterTree& tree, std::uint32_t a, std::uint32_t b,
                   std::vector<NodePair>& blocks) {
  const Cluster &first = tree.clusters[a], &second = tree.clusters[b];
  if (a == b) {
    if (first.is_leaf()) return;
    append_blocks(tree, first.first_child, first.first_child, blocks);
    append_blocks(tree, first.first_child, first.first_child + 1, blocks);
    append_blocks(tree, first.first_child + 1, first.first_child + 1, blocks);
    return;
  }
  if (std::max(first.count, second.count) <= kBlockSide) {
    blocks.push_back({a, b});
    return;
  }
  for (std::uint32_t k = 0; k < 2; ++k) {
    if (first.count > second.count) {
      append_blocks(tree, first.first_child + k, b, blocks);
    } else {
      append_blocks(tree, a, second.first_child + k, blocks);
    }
  }
}

/// Those of patches with themselves.
std::vector<AffineLink> links_to_themselves(const SpreadTree& tree, const SortedPairs& pairs) {
  std::vector<AffineLink> links;
  for (std::uint32_t node = 0; node < tree.tree.clusters.size(); ++node) {
    if (!tree.tree.clusters[node].is_leaf()) continue;
    const PositionRange range = tree.range(node);
    for (const auto& pair : pairs.of_row(range.begin, range)) {
      links.push_back({.a = node, .b = node, .exchange = pair.exchange});
    }
  }
  return links;
}

/// For each node the room that all of its patches are in, or kNone.
std::vector<std::uint32_t> rooms_of_nodes(const ClusterTree& tree,
                                          std::span<const std::uint32_t> room) {
  std::vector<std::uint32_t> of_node(tree.clusters.size());
  for (std::size_t k = of_node.size(); k-- > 0;) {
    const Cluster& cluster = tree.clusters[k];
    if (cluster.is_leaf()) {
      of_node[k] = room[tree.patch[cluster.begin]];
    } else {
      const std::uint32_t first = of_node[cluster.first_child];
      of_node[k] = first == of_node[cluster.first_child + 1] ? first : kNone;
    }
  }
  return of_node;
}

/// Block by block, in their order.
std::vector<std::vector<AffineLink>> choose_links(const SpreadTree& tree, const SortedPairs& pairs,
                                                  const PatchTable& patches, double price,
                                                  const Progress& progress) {
  std::vector<NodePair> blocks;
  append_blocks(tree.tree, 0, 0, blocks);
  std::vector<std::vector<AffineLink>> links(blocks.size() + 1);
  links[blocks.size()] = links_to_themselves(tree, pairs);
  ParallelProgress finished(progress, blocks.size());
#pragma omp parallel
  {
    BlockFitting fitting(tree, pairs, patches, price);
#pragma omp for schedule(dynamic, 1)
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      if (finished.stopped()) continue;
      links[k] = fitting.fit(blocks[k]);
      finished.advance();
    }
  }
  finished.finish();
  return links;
}

/// The sums of the rows of F and the square of the Frobenius norm of A^1/2 F A^-1/2.
struct Totals {
  std::vector<float> row_sum;
  double squared = 0;
};

Totals totals_of(const ExchangeMatrix& exchange, const std::vector<float>& area) {
  std::vector<double> sum(area.size());
  Totals totals;
  for (std::uint32_t i = 0; i < area.size(); ++i) {
    for (std::uint64_t k = exchange.row_begin[i]; k < exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = exchange.column[k];
      const double value = exchange.exchange_area[k];
      sum[i] += value / area[i];
      if (j != i) sum[j] += value / area[j];
      totals.squared += (i == j ? 1 : 2) * value * value / (static_cast<double>(area[i]) * area[j]);
    }
  }
  totals.row_sum.assign(sum.begin(), sum.end());
  return totals;
}

FormFactorLinks without_links(const ClusterTree& tree) {
  FormFactorLinks links;
  links.patch = tree.patch;
  for (const Cluster& cluster : tree.clusters) {
    links.first_child.push_back(cluster.first_child);
    links.count.push_back(cluster.count);
  }
  links.scale.assign(tree.patch.size(), 1);
  return links;
}

}  // namespace

FormFactorLinks fit_links(const ExchangeMatrix& exchange, const PatchTable& patches, double worth,
                          const Progress& progress) {
  if (exchange.patch_count() != patches.size() || patches.size() == 0) {
    throw Error("links: form factors and patches differ in number");
  }
  if (!(worth > 0) || !std::isfinite(worth)) {
    throw Error("links: what each must be worth is to be above 0 and finite");
  }
  const std::vector<std::uint32_t> room = find_rooms(exchange);
  SpreadTree tree{build_cluster_tree(patches, 1, 1, room_groups(room)), {}, {}};
  tree.room = rooms_of_nodes(tree.tree, room);
  FormFactorLinks links = without_links(tree.tree);
  tree.spread = spread_nodes(links, patches.area, patches.centroid);
  const Totals totals = totals_of(exchange, patches.area);
  const double price = worth * worth * totals.squared / static_cast<double>(patches.size());
  const SortedPairs pairs(exchange, tree.tree.patch);
  for (const auto& of_block : choose_links(tree, pairs, patches, price, progress)) {
    for (const AffineLink& link : of_block) append_link(link, links);
  }
  scale_rows(totals.row_sum, patches.area, patches.centroid, links);
  return links;
}

}  // namespace rebounce
