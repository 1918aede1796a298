#include "runtime/frame/receiver_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace rebounce {
namespace {

// A difference of one in normals is worth this part of the diagonal of a box: walls of a room are
// told apart before they are cut.
constexpr float kNormalPart = 0.5F;

// Below this part of the lengths in a dot product a height is taken for a rounding error.
constexpr float kHeightRounding = 1e-5F;

/// Sorts patches by halving them where they differ most.
class ReceiverHalving {
 public:
  ReceiverHalving(std::span<const LitPoint> patch, std::size_t piece)
      : patch_(patch), piece_(piece), order_(patch.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    halve(0, order_.size());
  }

  std::vector<std::uint32_t> take() { return std::move(order_); }

 private:
  void halve(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    if (count < 2) return;
    const std::size_t unit = count > piece_ ? piece_ : 1;
    const std::size_t middle = begin + (count / 2 + unit - 1) / unit * unit;
    const int axis = widest_axis(begin, end);
    const auto key = [&](std::uint32_t patch) {
      const LitPoint& point = patch_[patch];
      return std::pair(axis < 3 ? point.position[axis] : point.normal[axis - 3], patch);
    };
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end),
                     [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    halve(begin, middle);
    halve(middle, end);
  }

  /// 0 to 2: of the positions; 3 to 5: of the normals.
  int widest_axis(std::size_t begin, std::size_t end) const {
    Box positions, normals;
    for (std::size_t k = begin; k < end; ++k) {
      positions.add(patch_[order_[k]].position);
      normals.add(patch_[order_[k]].normal);
    }
    const glm::vec3 apart = positions.extent();
    const glm::vec3 turned = kNormalPart * glm::length(apart) * normals.extent();
    const std::array<float, 6> widths{apart.x, apart.y, apart.z, turned.x, turned.y, turned.z};
    return static_cast<int>(std::ranges::max_element(widths) - widths.begin());
  }

  std::span<const LitPoint> patch_;
  std::size_t piece_;
  std::vector<std::uint32_t> order_;
};

}  // namespace

void ReceiverBounds::add(const LitPoint& point) {
  box.add(point.position);
  normals.add(point.normal);
  lowest_plane = std::min(lowest_plane, glm::dot(point.normal, point.position));
}

bool ReceiverBounds::may_receive(const PreparedLight& lamp) const {
  if (box.distance_squared(lamp.position) >= lamp.reach_squared) return false;
  const bool has_place = lamp.kind->has_place();
  // dot(normal, place of the lamp - point), or the cosine for a lamp without a place, at most.
  const glm::vec3 toward = has_place ? lamp.position : -lamp.direction;
  const glm::vec3 most = glm::max(normals.low * toward, normals.high * toward);
  const float above = most.x + most.y + most.z + lamp.extent() - (has_place ? lowest_plane : 0);
  const float lengths =
      glm::length(toward) + glm::length(glm::max(glm::abs(box.low), glm::abs(box.high)));
  if (above < -kHeightRounding * lengths) return false;
  if (lamp.kind->may_reach == nullptr) return true;
  const glm::vec3 centre = 0.5F * (box.low + box.high);
  return lamp.kind->may_reach(lamp, centre, 0.5F * static_cast<float>(box.diagonal()));
}

std::vector<std::uint32_t> receiver_order(std::span<const LitPoint> patch, std::size_t piece) {
  return ReceiverHalving(patch, piece).take();
}

}  // namespace rebounce
