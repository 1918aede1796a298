#pragma once

// Which pairs of nodes of a tree get links.

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/exchange/links/affine_links.h"
#include "precompute/exchange/links/pair_sums.h"
#include "precompute/patches/cluster_tree.h"

namespace rebounce {

/// A tree over the patches and how its nodes are spread.
struct SpreadTree {
  ClusterTree tree;
  std::vector<NodeSpread> spread;
  std::vector<std::uint32_t> room;  ///< that all patches of a node are in, or kNone

  PositionRange range(std::uint32_t node) const {
    return {tree.clusters[node].begin, tree.clusters[node].count};
  }
};

/// The links, each the least squares of its pairs, of the least squared error plus `multiplier` for
/// each, for each of the blocks that the pairs are cut into; those of patches with themselves last.
/// Links are of nodes of one room. The same bits for any number of threads. Throws Cancelled when
/// `progress` says so.
std::vector<std::vector<AffineLink>> choose_links(const SpreadTree& tree, const PairSource& pairs,
                                                  const PatchTable& patches, double multiplier,
                                                  const Progress& progress);

}  // namespace rebounce
