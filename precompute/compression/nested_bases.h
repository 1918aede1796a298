#pragma once

#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"
#include "precompute/compression/wanted_blocks.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// The data of a compression that nest_bases needs.
struct NestingFrame {
  const ClusterTree& tree;
  const std::vector<ClusterWeight>& weights;  ///< of the clusters
  const WantedBlocks& wanted;
  CompressionCost cost;
};

/// Gives the large blocks of an operator, in f32 and the order kByBlock, cluster bases.
///
/// Over a patch there are some tens of large blocks with some tens of vectors each. Within a small
/// cluster, a *cell*, these are combinations of far fewer vectors. A cell therefore has one basis
/// that all large blocks over it share, and a block stores transfer matrices (nested bases in one
/// level: W. Hackbusch and S. Börm, "Data-sparse approximation by adaptive H2-matrices", 2002). The
/// rank of a cell follows from the multiplier, as the ranks of blocks do: a vector is kept if it
/// removes more weighted error than its values cost. If there is nothing to gain, the operator is
/// returned as it is.
HierarchicalStorage nest_bases(HierarchicalStorage storage, const NestingFrame& frame);

}  // namespace rebounce
