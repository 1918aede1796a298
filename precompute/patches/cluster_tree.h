#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/file/transfer_data.h"
#include "transfer/format/operator_format.h"

namespace rebounce {

/// A set of patches that lie near each other and face similar ways: a range of positions.
struct Cluster {
  std::uint32_t begin = 0, count = 0;  ///< multiples of the tree's alignment
  std::uint32_t first_child = kNone;   ///< the second child follows it; kNone for a leaf

  bool is_leaf() const { return first_child == kNone; }
};

/// A binary tree of clusters over the patches; the root is the first cluster.
///
/// A cluster is split across the principal axis of the positions and normals of its patches, taken
/// together as points in six dimensions. Splits fall on multiples of the alignment, so that only
/// the end is padded, with positions that hold no patch. Clusters are stored level by level.
struct ClusterTree {
  std::vector<std::uint32_t> patch;  ///< [n] patch at each position
  std::vector<Cluster> clusters;
};

/// Builds the tree. Leaves have at most `leaf_size` positions, a multiple of `alignment`; if both
/// are 1, the leaves are the patches. With `group` [n], patches of different groups are separated
/// first, in the order of the groups. Only leaves, which the alignment keeps together, and clusters
/// of whole groups then have patches of several groups.
ClusterTree build_cluster_tree(
    const PatchTable& patches, std::uint32_t leaf_size,
    std::uint32_t alignment = static_cast<std::uint32_t>(HierarchicalFormat::kAlignment),
    std::span<const std::uint8_t> group = {});

/// The largest clusters of at most `most` positions, and leaves, by index: they cover all
/// positions, in their order.
std::vector<std::uint32_t> clusters_up_to(const ClusterTree& tree, std::uint32_t most);

/// The patches at the positions of a cluster.
std::span<const std::uint32_t> patches_of(const ClusterTree& tree, const Cluster& cluster);

}  // namespace rebounce
