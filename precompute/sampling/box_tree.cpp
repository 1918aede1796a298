#include "precompute/sampling/box_tree.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <utility>

namespace rebounce {
namespace {

constexpr std::uint32_t kLeafSize = 8;

}  // namespace

BoxTree::BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  nodes_.push_back({{}, 0, static_cast<std::uint32_t>(order_.size())});
  for (std::size_t k = 0; k < nodes_.size(); ++k) split(k);
}

/// Splits a node at the median of the middles of its boxes, along the longest axis of the node.
void BoxTree::split(std::size_t index) {
  Node node = nodes_[index];
  for (std::uint32_t k = node.begin; k < node.end; ++k) {
    node.box.add(boxes_[order_[k]].low);
    node.box.add(boxes_[order_[k]].high);
  }
  if (node.end - node.begin > kLeafSize) {
    const glm::vec3 extent = node.box.high - node.box.low;
    int axis = extent.y > extent.x ? 1 : 0;
    if (extent.z > extent[axis]) axis = 2;
    const auto twice_middle = [&](std::uint32_t b) {
      return std::pair(boxes_[b].low[axis] + boxes_[b].high[axis], b);
    };
    const std::uint32_t half = node.begin + (node.end - node.begin) / 2;
    std::ranges::nth_element(order_.begin() + node.begin, order_.begin() + half,
                             order_.begin() + node.end, {}, twice_middle);
    node.first_child = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({{}, node.begin, half});
    nodes_.push_back({{}, half, node.end});
  }
  nodes_[index] = node;
}

void BoxTree::find(const ConvexRegion& region, std::vector<std::uint32_t>& found) const {
  found.clear();
  // Splitting 2^32 boxes goes no deeper than this, and each level leaves one more node on the
  // stack.
  std::array<std::uint32_t, 40> stack = {0};
  std::size_t waiting = 1;
  while (waiting > 0) {
    const Node& node = nodes_[stack[--waiting]];
    if (!region.may_meet(node.box)) continue;
    if (node.first_child != 0) {
      stack[waiting++] = node.first_child;
      stack[waiting++] = node.first_child + 1;
      continue;
    }
    for (std::uint32_t k = node.begin; k < node.end; ++k) {
      if (region.may_meet(boxes_[order_[k]])) found.push_back(order_[k]);
    }
  }
  std::ranges::sort(found);
}

}  // namespace rebounce
