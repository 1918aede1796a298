#pragma once

#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"
#include "precompute/compression/wanted_blocks.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// What a compression knows of its blocks.
struct NestingFrame {
  const ClusterTree& tree;
  const std::vector<ClusterWeight>& weights;  ///< of its clusters
  const WantedBlocks& wanted;
  CompressionCost cost;
};

/// Gives the large blocks of an operator, in f32 and the order kByBlock, cluster coefficients for
/// positions.
///
/// Over a patch there are some tens of large blocks with some tens of vectors each, and within a
/// small cluster, a *cell*, these are combinations of far fewer: cells have bases that all large
/// blocks over them share, and of the vectors of these are kept what they are combined from
/// (nested bases in one level: W. Hackbusch and S. Börm, "Data-sparse approximation by adaptive
/// H2-matrices", 2002). How many vectors a cell has follows from the multiplier, as ranks of blocks
/// do: as long as one takes away more error, weighed in the same way, than its values cost. Where
/// there is nothing to gain the operator is returned as it is.
HierarchicalStorage nest_bases(HierarchicalStorage storage, const NestingFrame& frame);

}  // namespace rebounce
