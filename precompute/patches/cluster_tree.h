#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/file/transfer_data.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

/// A set of patches that lie near each other and face the same way: a range of positions.
struct Cluster {
  std::uint32_t begin = 0, count = 0;  ///< multiples of the tree's alignment
  std::uint32_t first_child = kNone;   ///< the second follows it; kNone for a leaf

  bool is_leaf() const { return first_child == kNone; }
};

/// A binary tree of clusters over the patches; the root is the first cluster.
///
/// A cluster is split across the principal axis of its patches' positions and normals, taken
/// together as points of six dimensions. Splits fall on multiples of the alignment, so that only
/// the very end is padded, with positions that hold no patch. Clusters come level by level.
struct ClusterTree {
  std::vector<std::uint32_t> patch;  ///< [n] patch at each position
  std::vector<Cluster> clusters;
};

/// Builds the tree; leaves have at most `leaf_size` positions, a multiple of `alignment`. With 1
/// and 1 the leaves are the patches. With `group` [n], patches of different groups are parted
/// before anything else, in the order of the groups: only leaves, which multiples of the alignment
/// cannot part, and clusters of whole groups have patches of several.
ClusterTree build_cluster_tree(
    const PatchTable& patches, std::uint32_t leaf_size,
    std::uint32_t alignment = static_cast<std::uint32_t>(HierarchicalFormat::kAlignment),
    std::span<const std::uint8_t> group = {});

/// Those at the positions of a cluster that hold one.
std::span<const std::uint32_t> patches_of(const ClusterTree& tree, const Cluster& cluster);

}  // namespace rebounce
