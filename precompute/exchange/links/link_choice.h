#pragma once

// Chooses the pairs of nodes of a tree that get links.

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/affine_links.h"
#include "precompute/exchange/links/pair_sums.h"
#include "precompute/patches/cluster_tree.h"

namespace rebounce {

/// A tree over the patches, and the spread of its nodes.
struct SpreadTree {
  ClusterTree tree;
  std::vector<NodeSpread> spread;
  std::vector<std::uint32_t> room;  ///< room that contains all patches of a node, or kNone

  PositionRange range(std::uint32_t node) const {
    return {tree.clusters[node].begin, tree.clusters[node].count};
  }
};

/// The links with the least sum of squared error plus `multiplier` for each link, for each of the
/// blocks that the pairs are cut into; the links of patches with themselves come last. Each link is
/// the least-squares fit of its pairs and joins nodes of one room. The bits do not depend on the
/// number of threads. Throws Cancelled if `progress` asks to stop.
std::vector<std::vector<AffineLink>> choose_links(const SpreadTree& tree, const PairSource& pairs,
                                                  const PatchTable& patches, double multiplier,
                                                  const Progress& progress);

}  // namespace rebounce
