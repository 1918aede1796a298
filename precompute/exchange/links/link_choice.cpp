#include "precompute/exchange/links/link_choice.h"

#include <algorithm>
#include <limits>
#include <span>

#include "precompute/base/parallel_loop.h"
#include "precompute/base/parallel_progress.h"
#include "precompute/base/ranks.h"

namespace rebounce {
namespace {

using Eigen::Vector3d;

// Side, in patches, of the blocks in which links are chosen. In scenes of thousands of patches no
// single link is worth a larger block, and the tables of larger blocks do not fit into caches
// (lab/016, lab/182).
constexpr std::uint32_t kBlockSide = 128;

struct NodePair {
  std::uint32_t a, b;
};

/// A node and all nodes below it; the children of a node are neighbours.
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
  /// Index of the first child in the list, or kNone.
  std::uint32_t first_child(std::uint32_t k) const { return child_[k]; }

 private:
  std::vector<std::uint32_t> node_, child_;
};

/// Chooses the links of one block after another.
class BlockFitting {
 public:
  BlockFitting(const SpreadTree& tree, const PairSource& pairs, const PatchTable& patches,
               double multiplier)
      : tree_(tree), sums_(pairs, patches, tree.tree.patch), multiplier_(multiplier) {}

  /// The links between two nodes; the first node comes before the second.
  std::vector<AffineLink> fit(const NodePair& block) {
    if (!sums_.add_up(tree_.range(block.a), tree_.range(block.b))) return {};
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
    double cost = 0;  ///< squared error plus the multiplier for each link
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

  /// Without this condition a link could carry light through a wall.
  bool is_of_one_room(std::uint32_t i, std::uint32_t j) const {
    const std::uint32_t room = tree_.room[a_.node(i)];
    return room != kNone && room == tree_.room[b_.node(j)];
  }

  /// The least cost for entries i and j of the two subtrees.
  double cost(std::uint32_t i, std::uint32_t j) {
    if (choice(i, j).kind == Kind::kUnknown) choice(i, j) = choose(i, j);
    return choice(i, j).cost;
  }

  Choice choose(std::uint32_t i, std::uint32_t j) {
    const PairSums pairs = sums(i, j);
    // Rounding may turn an exchange that is tiny beside others in the tables into 0 or less.
    if (pairs.count == 0 || pairs.exchange <= 0) return {0, Kind::kNothing};
    Choice best{kForbidden, Kind::kLink};
    if (is_of_one_room(i, j)) {
      const double error = squared_error(i, j, pairs);
      best.cost = error + multiplier_;
      // A second link costs more than it could save.
      if (error <= multiplier_) return best;
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
  SummedPairTable sums_;
  const double multiplier_;
  Subtree a_, b_;
  std::vector<Choice> choice_;  ///< [a][b]
};

/// Appends the pairs of nodes of at most kBlockSide patches that make up the pair (a, b); a comes
/// before b or equals it.
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

/// [n] The leaf at each position.
std::vector<std::uint32_t> leaves_of(const ClusterTree& tree) {
  std::vector<std::uint32_t> leaf(tree.patch.size());
  for (std::uint32_t node = 0; node < tree.clusters.size(); ++node) {
    if (tree.clusters[node].is_leaf()) leaf[tree.clusters[node].begin] = node;
  }
  return leaf;
}

/// The links of patches with themselves.
std::vector<AffineLink> links_to_themselves(const SpreadTree& tree, const PairSource& pairs) {
  std::vector<AffineLink> links;
  std::vector<float> block(std::size_t{kBlockSide} * kBlockSide);
  const std::vector<std::uint32_t> leaf = leaves_of(tree.tree);
  const auto n = static_cast<std::uint32_t>(leaf.size());
  for (std::uint32_t begin = 0; begin < n; begin += kBlockSide) {
    const PositionRange range{begin, std::min(kBlockSide, n - begin)};
    pairs.block(range, range, std::span(block).first(std::size_t{range.count} * range.count));
    for (std::uint32_t k = 0; k < range.count; ++k) {
      const float exchange = block[std::size_t{k} * (range.count + 1)];
      if (exchange == 0) continue;
      links.push_back({.a = leaf[begin + k], .b = leaf[begin + k], .exchange = exchange});
    }
  }
  return links;
}

}  // namespace

std::vector<std::vector<AffineLink>> choose_links(const SpreadTree& tree, const PairSource& pairs,
                                                  const PatchTable& patches, double multiplier,
                                                  const Progress& progress) {
  std::vector<NodePair> blocks;
  append_blocks(tree.tree, 0, 0, blocks);
  std::vector<std::vector<AffineLink>> links(blocks.size() + 1);
  links[blocks.size()] = links_to_themselves(tree, pairs);
  const Ranks ranks;
  ParallelProgress finished(progress, blocks.size());
  parallel_loop(
      blocks.size(), 1, [&] { return BlockFitting(tree, pairs, patches, multiplier); },
      [&](std::size_t k, BlockFitting& fitting) {
        if (finished.stopped() || !ranks.makes(k)) return;
        links[k] = fitting.fit(blocks[k]);
        finished.advance();
      });
  finished.finish();
  share(ranks, std::span(links).first(blocks.size()));
  return links;
}

}  // namespace rebounce
