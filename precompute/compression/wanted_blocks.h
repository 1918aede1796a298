#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/cluster_tree.h"
#include "transfer/data/patch_roles.h"

namespace rebounce {

/// How a cluster tree is to part the patches for blocks to be wanted or not as a whole, [n], empty
/// where all are both: first those with both roles, then of receivers alone and sources alone the
/// fewer, then the others, and last those with no role. Below the diagonal no block that is wanted
/// then has columns of the last two.
std::vector<std::uint8_t> role_groups(const PatchRoles& roles);

/// Which blocks of an operator over a cluster tree its roles ask for. Y restricted to the rows of
/// receivers and the columns of sources is a part of the whole matrix, whose light goes by way of
/// all patches.
class WantedBlocks {
 public:
  /// `roles` must outlive the object.
  WantedBlocks(const PatchRoles& roles, const ClusterTree& tree);

  /// Whether light of the cluster `from` is wanted in the cluster `to`.
  bool leads(std::uint32_t from, std::uint32_t to) const {
    return sends_[from] != 0 && receives_[to] != 0;
  }

  /// The same in either direction: by reciprocity a block serves both.
  bool wanted(std::uint32_t row, std::uint32_t column) const {
    return leads(row, column) || leads(column, row);
  }

  /// Whether a cluster has patches of several roles that its children part.
  bool is_mixed(std::uint32_t cluster) const { return mixed_[cluster] != 0; }

  /// Sets the entries [rows][columns] to 0 that are wanted in neither direction.
  void clear_unwanted(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> columns,
                      Eigen::Ref<Eigen::MatrixXf> entries) const;

 private:
  const PatchRoles& roles_;
  std::vector<std::uint8_t> receives_, sends_, mixed_;  ///< by cluster
};

}  // namespace rebounce
