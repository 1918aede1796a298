#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace rebounce {

/// Which links each node has, in their order; a link between two nodes is with both.
class LinksByNode {
 public:
  /// `ends`(k) are the two nodes of link k, as an array.
  template <typename Ends>
  LinksByNode(std::size_t node_count, std::size_t link_count, const Ends& ends)
      : begin_(node_count + 1, 0) {
    for (std::size_t k = 0; k < link_count; ++k) {
      const auto [a, b] = ends(k);
      ++begin_[a + 1];
      if (a != b) ++begin_[b + 1];
    }
    for (std::size_t node = 0; node < node_count; ++node) begin_[node + 1] += begin_[node];
    link_.resize(begin_.back());
    std::vector<std::uint64_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t k = 0; k < link_count; ++k) {
      const auto [a, b] = ends(k);
      link_[next[a]++] = k;
      if (a != b) link_[next[b]++] = k;
    }
  }

  std::span<const std::uint32_t> operator[](std::size_t node) const {
    return {link_.data() + begin_[node], link_.data() + begin_[node + 1]};
  }

  /// [m + 1] where the links of each node begin in a list of all of them, node by node.
  const std::vector<std::uint64_t>& offsets() const { return begin_; }

 private:
  std::vector<std::uint64_t> begin_;
  std::vector<std::uint32_t> link_;
};

}  // namespace rebounce
