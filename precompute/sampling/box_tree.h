#pragma once

#include <cstdint>
#include <vector>

#include "precompute/sampling/convex_region.h"
#include "runtime/rays/box.h"

namespace rebounce {

/// A binary tree over boxes that finds the boxes in a region. Immutable, usable from any number of
/// threads.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box> boxes);

  /// Writes the numbers of the boxes that may meet `region` to `found`, ascending.
  void find(const ConvexRegion& region, std::vector<std::uint32_t>& found) const;

 private:
  struct Node {
    Box box;
    std::uint32_t begin, end;  ///< in order_
    /// Index of the first child, the second follows it; 0 for a leaf.
    std::uint32_t first_child = 0;
  };

  void split(std::size_t index);

  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace rebounce
