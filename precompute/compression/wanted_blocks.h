#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/cluster_tree.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// Groups of patches by role, [n], for a cluster tree whose blocks are wanted or not as a whole,
/// and within a role by `group` (SymmetricMatrix::group); empty if all patches are alike. The order
/// is: both roles; receivers or sources alone, whichever are fewer; the others of these two; no
/// role. A wanted block below the diagonal then has no columns of the last two roles.
std::vector<std::uint8_t> tree_groups(const PatchRoles& roles, std::span<const std::uint8_t> group);

/// The blocks of an operator over a cluster tree that its roles need: rows of receivers and columns
/// of sources. Light still passes by all patches.
class WantedBlocks {
 public:
  /// `roles` must outlive the object.
  WantedBlocks(const PatchRoles& roles, const ClusterTree& tree);

  /// True if light of the cluster `from` is wanted in the cluster `to`.
  bool leads(std::uint32_t from, std::uint32_t to) const {
    return sends_[from] != 0 && receives_[to] != 0;
  }

  /// True if a block is wanted in either direction: by reciprocity it serves both.
  bool wanted(std::uint32_t row, std::uint32_t column) const {
    return leads(row, column) || leads(column, row);
  }

  /// True if a cluster has patches of several roles that its children separate.
  bool is_mixed(std::uint32_t cluster) const { return mixed_[cluster] != 0; }

  /// Sets entries [rows][columns] to 0 that are wanted in neither direction.
  void clear_unwanted(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns,
                      Eigen::Ref<Eigen::MatrixXf> entries) const;

 private:
  const PatchRoles& roles_;
  std::vector<std::uint8_t> receives_, sends_, mixed_;  ///< by cluster
};

}  // namespace rebounce
