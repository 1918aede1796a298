#include "precompute/compression/wanted_blocks.h"

#include <algorithm>
#include <array>

namespace rebounce {

namespace {

/// Groups by role alone, [n] or empty.
std::vector<std::uint8_t> role_groups(const PatchRoles& roles) {
  const std::size_t n = roles.role.size();
  const bool fewer_receivers =
      roles.count(PatchRoles::kReceiver, n) <= roles.count(PatchRoles::kSource, n);
  std::array<std::uint8_t, PatchRoles::kBoth + 1> group{};
  group[PatchRoles::kReceiver] = fewer_receivers ? 1 : 2;
  group[PatchRoles::kSource] = fewer_receivers ? 2 : 1;
  group[0] = 3;
  std::vector<std::uint8_t> groups;
  groups.reserve(n);
  for (const std::uint8_t role : roles.role) groups.push_back(group[role]);
  return groups;
}

}  // namespace

std::vector<std::uint8_t> tree_groups(const PatchRoles& roles,
                                      std::span<const std::uint8_t> group) {
  std::vector<std::uint8_t> groups = role_groups(roles);
  if (group.empty()) return groups;
  groups.resize(group.size());
  for (std::size_t p = 0; p < group.size(); ++p) {
    groups[p] = static_cast<std::uint8_t>(groups[p] * kMostPatchGroups + group[p]);
  }
  return groups;
}

WantedBlocks::WantedBlocks(const PatchRoles& roles, const ClusterTree& tree)
    : roles_(roles),
      receives_(tree.clusters.size()),
      sends_(tree.clusters.size()),
      mixed_(tree.clusters.size()) {
  for (std::size_t c = 0; c < tree.clusters.size(); ++c) {
    const Cluster& cluster = tree.clusters[c];
    const auto patches = patches_of(tree, cluster);
    for (const std::uint32_t p : patches) {
      if (roles.is_receiver(p)) receives_[c] = 1;
      if (roles.is_source(p)) sends_[c] = 1;
      const bool other = !roles.all_are_both() && roles.role[p] != roles.role[patches.front()];
      if (other && !cluster.is_leaf()) mixed_[c] = 1;
    }
  }
}

void WantedBlocks::clear_unwanted(std::span<const std::uint32_t> rows,
                                  std::span<const std::uint32_t> columns,
                                  Eigen::Ref<Eigen::MatrixXf> entries) const {
  if (roles_.all_are_both()) return;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const bool receives = roles_.is_receiver(columns[j]), sends = roles_.is_source(columns[j]);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const bool wanted =
          (receives && roles_.is_source(rows[i])) || (sends && roles_.is_receiver(rows[i]));
      if (!wanted) entries(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = 0;
    }
  }
}

}  // namespace rebounce
