#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/links/link_refinement.h"
#include "precompute/exchange/links/link_tree.h"
#include "precompute/exchange/pairs/hemisphere_exchange.h"

namespace rebounce {

/// The pairs of nodes that shadow rays have found hidden from each other. Through small openings
/// and near contacts some of their patches see each other, which hemisphere rays tell.
class HiddenLinks {
 public:
  /// Finds those of `links` that are not between two single patches. `tree` must outlive the
  /// object.
  HiddenLinks(const LinkTree& tree, std::span<const Link> links);

  bool empty() const { return partner_.empty(); }

  /// The patches of `met` by the rays of patch i that should be hidden from it, in their order.
  std::vector<MetPatch> seen(std::uint32_t i, std::span<const MetPatch> met) const;

  /// The leaf of a patch.
  std::uint32_t leaf(std::uint32_t patch) const { return leaf_[patch]; }

 private:
  const LinkTree& tree_;
  std::vector<std::uint32_t> parent_;    ///< [nodes] kNone for the root
  std::vector<std::uint32_t> leaf_;      ///< [n]
  std::vector<std::uint32_t> position_;  ///< [n] in the order of the tree
  std::vector<std::size_t> begin_;       ///< [nodes + 1] first partner of each node
  std::vector<std::uint32_t> partner_;   ///< nodes that are hidden from it
};

}  // namespace rebounce
