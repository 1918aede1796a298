#include "runtime/rays/triangle_tree.h"

#include <numeric>

#include "runtime/rays/box.h"

namespace rebounce {
namespace {

constexpr std::size_t kBinCount = 16;  // places at which a range of triangles may be cut

// Half of the surface of a box, m²; 0 if it has no point.
float half_surface(const Box& box) {
  const glm::vec3 side = glm::max(box.extent(), glm::vec3(0));
  return side.x * side.y + side.y * side.z + side.z * side.x;
}

void join(Box& box, const Box& other) {
  box.low = glm::min(box.low, other.low);
  box.high = glm::max(box.high, other.high);
}

}  // namespace

struct TriangleTree::Item {
  Box box;
  glm::vec3 middle;
  std::uint32_t triangle;
};

struct TriangleTree::Range {
  std::size_t begin, end;
  Box box;

  std::size_t size() const { return end - begin; }
};

/// Cuts ranges of triangles by the surface area heuristic (J. D. MacDonald, K. S. Booth,
/// "Heuristics for ray tracing using space subdivision", 1990), from the root down.
class TriangleTree::Builder {
 public:
  Builder(TriangleTree& tree, std::span<const Float3> position, std::span<const Uint3> triangle)
      : tree_(tree), position_(position), triangle_(triangle) {
    item_.reserve(triangle.size());
    for (std::uint32_t t = 0; t < triangle.size(); ++t) {
      Item item;
      for (const std::uint32_t vertex : triangle[t]) item.box.add(to_glm(position[vertex]));
      item.middle = 0.5F * (item.box.low + item.box.high);
      item.triangle = t;
      item_.push_back(item);
    }
  }

  void build() {
    if (!item_.empty()) add_node(range(0, item_.size()), 0);
  }

 private:
  Range range(std::size_t begin, std::size_t end) const {
    Range made{begin, end, {}};
    for (std::size_t k = begin; k < end; ++k) join(made.box, item_[k].box);
    return made;
  }

  /// Cuts a range of two triangles or more in two.
  std::array<Range, 2> cut(const Range& whole, std::size_t depth) {
    Box middles;
    for (std::size_t k = whole.begin; k < whole.end; ++k) middles.add(item_[k].middle);
    const glm::vec3 extent = middles.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                     : extent.y >= extent.z                       ? 1
                                                                  : 2;
    const auto first = item_.begin() + static_cast<std::ptrdiff_t>(whole.begin);
    const auto last = item_.begin() + static_cast<std::ptrdiff_t>(whole.end);
    auto between = first + static_cast<std::ptrdiff_t>(whole.size() / 2);
    if (extent[axis] > 0 && depth < kMostDepth) {
      const float scale = kBinCount / extent[axis];
      const auto bin = [&](const Item& item) {
        const float place = (item.middle[axis] - middles.low[axis]) * scale;
        return std::min(kBinCount - 1, static_cast<std::size_t>(std::max(place, 0.0F)));
      };
      const std::size_t best = best_cut(whole, bin);
      const auto parted =
          std::stable_partition(first, last, [&](const Item& item) { return bin(item) < best; });
      if (parted != first && parted != last) between = parted;
    }
    const auto place = static_cast<std::size_t>(between - item_.begin());
    return {range(whole.begin, place), range(place, whole.end)};
  }

  /// The first bin of the second part in the cut of the least cost.
  template <typename Bin>
  std::size_t best_cut(const Range& whole, const Bin& bin) const {
    std::array<Box, kBinCount> box;
    std::array<std::size_t, kBinCount> count{};
    for (std::size_t k = whole.begin; k < whole.end; ++k) {
      const std::size_t b = bin(item_[k]);
      join(box[b], item_[k].box);
      ++count[b];
    }
    std::array<float, kBinCount> after{};  // cost of bins [b, end)
    Box behind;
    std::size_t behind_count = 0;
    for (std::size_t b = kBinCount; b-- > 1;) {
      join(behind, box[b]);
      behind_count += count[b];
      after[b] = half_surface(behind) * static_cast<float>(behind_count);
    }
    Box before;
    std::size_t before_count = 0, best = 1;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t b = 1; b < kBinCount; ++b) {
      join(before, box[b - 1]);
      before_count += count[b - 1];
      const float cost = half_surface(before) * static_cast<float>(before_count) + after[b];
      if (cost < least) {
        least = cost;
        best = b;
      }
    }
    return best;
  }

  std::int32_t add_node(const Range& whole, std::size_t depth) {
    std::vector<Range> part = {whole};
    while (part.size() < kWidth) {
      // The part that costs most is cut next; a leaf's worth is left whole.
      const auto cost = [](const Range& range) {
        return range.size() <= kWidth ? 0 : half_surface(range.box) + 1e-30F;
      };
      const auto most = std::ranges::max_element(part, {}, cost);
      if (cost(*most) <= 0) break;
      const auto halves = cut(*most, depth);
      *most = halves[0];
      part.push_back(halves[1]);
    }
    const std::size_t place = tree_.node_.size();
    tree_.node_.emplace_back();
    Node node;
    constexpr float kFar = std::numeric_limits<float>::infinity();
    node.side[0].fill(repeat(kFar));
    node.side[1].fill(repeat(-kFar));
    node.child.fill(0);
    for (std::size_t k = 0; k < part.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        node.side[0][static_cast<std::size_t>(axis)][k] = part[k].box.low[axis];
        node.side[1][static_cast<std::size_t>(axis)][k] = part[k].box.high[axis];
      }
      node.child[k] = part[k].size() <= kWidth ? add_leaf(part[k]) : add_node(part[k], depth + 1);
    }
    tree_.node_[place] = node;
    return static_cast<std::int32_t>(place);
  }

  std::int32_t add_leaf(const Range& range) {
    Leaf leaf;
    for (auto& corner : leaf.corner) corner.fill(repeat(0));
    leaf.triangle.fill(kNone);
    for (std::size_t k = 0; k < range.size(); ++k) {
      const std::uint32_t t = item_[range.begin + k].triangle;
      leaf.triangle[k] = t;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const Float3& at = position_[triangle_[t][corner]];
        for (std::size_t axis = 0; axis < 3; ++axis) leaf.corner[corner][axis][k] = at[axis];
      }
    }
    tree_.leaf_.push_back(leaf);
    return ~static_cast<std::int32_t>(tree_.leaf_.size() - 1);
  }

  TriangleTree& tree_;
  std::span<const Float3> position_;
  std::span<const Uint3> triangle_;
  std::vector<Item> item_;
};

TriangleTree::TriangleTree(std::span<const Float3> position, std::span<const Uint3> triangle) {
  Builder(*this, position, triangle).build();
}

}  // namespace rebounce
