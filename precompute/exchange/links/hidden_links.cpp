#include "precompute/exchange/links/hidden_links.h"

#include <algorithm>
#include <utility>

namespace rebounce {

HiddenLinks::HiddenLinks(const LinkTree& tree, std::span<const Link> links)
    : tree_(tree),
      parent_(tree.nodes().size(), kNone),
      leaf_(tree.patches().size()),
      position_(tree.patches().size()),
      begin_(tree.nodes().size() + 1, 0) {
  for (std::uint32_t k = 0; k < parent_.size(); ++k) {
    const LinkNode& node = tree[k];
    if (node.is_leaf()) {
      leaf_[tree.leaf_patch(node)] = k;
      position_[tree.leaf_patch(node)] = node.begin;
    } else {
      parent_[node.first_child] = parent_[node.first_child + 1] = k;
    }
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> both;
  for (const Link& link : links) {
    if (link.exchange_area > 0 || link.joins_patches()) continue;
    both.emplace_back(link.a(), link.b());
    both.emplace_back(link.b(), link.a());
  }
  std::ranges::sort(both);
  for (const auto& [node, other] : both) {
    ++begin_[node + 1];
    partner_.push_back(other);
  }
  for (std::size_t k = 1; k < begin_.size(); ++k) begin_[k] += begin_[k - 1];
}

std::vector<MetPatch> HiddenLinks::seen(std::uint32_t i, std::span<const MetPatch> met) const {
  // Every pair of patches is in one link at most, so these ranges of positions are disjoint.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> hidden;
  for (std::uint32_t node = leaf_[i]; node != kNone; node = parent_[node]) {
    for (std::size_t k = begin_[node]; k < begin_[node + 1]; ++k) {
      const LinkNode& other = tree_[partner_[k]];
      hidden.emplace_back(other.begin, other.begin + other.count);
    }
  }
  std::ranges::sort(hidden);
  std::vector<MetPatch> result;
  for (const MetPatch& m : met) {
    const std::uint32_t place = position_[m.patch];
    const auto after = std::ranges::upper_bound(hidden, place, {},
                                                &std::pair<std::uint32_t, std::uint32_t>::first);
    if (after != hidden.begin() && place < std::prev(after)->second) result.push_back(m);
  }
  return result;
}

}  // namespace rebounce
