#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

namespace rebounce {

/// An axis-aligned box; an empty one meets nothing.
struct Box {
  glm::vec3 low{std::numeric_limits<float>::infinity()};
  glm::vec3 high{-std::numeric_limits<float>::infinity()};

  void add(const glm::vec3& point) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  /// True if they have a point in common.
  bool meets(const Box& other) const {
    return glm::all(glm::lessThanEqual(low, other.high)) &&
           glm::all(glm::lessThanEqual(other.low, high));
  }
};

/// A binary tree over boxes that finds those that meet another. Immutable, usable from any number
/// of threads.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box> boxes);

  /// Puts the numbers of the boxes that meet `box` into `found`, ascending.
  void find(const Box& box, std::vector<std::uint32_t>& found) const;

 private:
  struct Node {
    Box box;
    std::uint32_t begin, end;       ///< in order_
    std::uint32_t first_child = 0;  ///< the second follows it; 0 for a leaf
  };

  void split(std::size_t index);

  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace rebounce
