#include "runtime/rays/occluders.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/ray_offset.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

using Outline = std::vector<glm::dvec2>;  // counter-clockwise

// Pairs of a side and a corner that are compared for one plane, some 50 ms. A round outline of n
// sides compares n³ / 6.
constexpr std::size_t kMostCompared = std::size_t{1} << 22U;

struct Side {
  glm::dvec2 from, to;  // what it bounds is on its left

  double length() const { return glm::distance(from, to); }
};

/// Twice the signed area of a triangle.
double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// How far `p` is to the left of the line through a side.
double height(const Side& line, const glm::dvec2& p) {
  return turn(line.from, line.to, p) / line.length();
}

/// The place between `a` and `b` where heights of opposite signs say that a line passes.
glm::dvec2 crossing(const glm::dvec2& a, const glm::dvec2& b, double height_a, double height_b) {
  return glm::mix(a, b, height_a / (height_a - height_b));
}

/// Cuts what one plane has of a surface, given by its sides, into convex pieces: along the lines of
/// its sides, by a binary space partition (H. Fuchs, Z. Kedem, B. Naylor, "On visible surface
/// generation by a priori tree structures", 1980).
class ConvexPieces {
 public:
  ConvexPieces(std::span<const Side> side, double tolerance) : side_(side), tolerance_(tolerance) {
    glm::dvec2 low = side[0].from, high = low;
    for (const Side& s : side) {
      low = glm::min(low, s.from);
      high = glm::max(high, s.from);
    }
    cut({low, {high.x, low.y}, high, {low.x, high.y}}, {side.begin(), side.end()});
  }

  std::vector<Outline> take() { return std::move(piece_); }

  /// False if the pieces do not cover the surface, because it would take too long.
  bool is_whole() const { return compared_ <= kMostCompared; }

 private:
  /// `side`: those that may pass through `cell`.
  void cut(Outline cell, std::vector<Side> side) {
    if (cell.size() < 3) return;
    compared_ += cell.size() * side.size();
    if (!is_whole()) return;
    std::erase_if(side, [&](const Side& s) { return is_on_border(cell, s); });
    if (side.empty()) {
      if (is_inside(cell)) piece_.push_back(std::move(cell));
      return;
    }
    const Side line = *std::ranges::max_element(side, {}, &Side::length);
    for (const bool left : {true, false}) {
      std::vector<Side> part;
      for (const Side& s : side) add_part(line, left, s, part);
      cut(part_of(line, left, cell), std::move(part));
    }
  }

  bool is_on_border(const Outline& cell, const Side& side) const {
    if (side.length() <= 2 * tolerance_) return true;
    for (std::size_t k = 0; k < cell.size(); ++k) {
      const Side border{cell[k], cell[(k + 1) % cell.size()]};
      if (border.length() > 0 && height(border, side.from) < tolerance_ &&
          height(border, side.to) < tolerance_) {
        return true;
      }
    }
    return false;
  }

  Outline part_of(const Side& line, bool left, const Outline& cell) const {
    Outline part;
    for (std::size_t k = 0; k < cell.size(); ++k) {
      const glm::dvec2 &a = cell[k], &b = cell[(k + 1) % cell.size()];
      const double sign = left ? 1 : -1;
      const double height_a = sign * height(line, a), height_b = sign * height(line, b);
      if (height_a >= -tolerance_) part.push_back(a);
      if (std::min(height_a, height_b) < -tolerance_ && std::max(height_a, height_b) > tolerance_) {
        part.push_back(crossing(a, b, height_a, height_b));
      }
    }
    return part;
  }

  void add_part(const Side& line, bool left, const Side& side, std::vector<Side>& parts) const {
    const double sign = left ? 1 : -1;
    const double from = sign * height(line, side.from), to = sign * height(line, side.to);
    if (std::max(from, to) <= tolerance_) return;
    Side part = side;
    if (from < -tolerance_) part.from = crossing(side.from, side.to, from, to);
    if (to < -tolerance_) part.to = crossing(side.from, side.to, from, to);
    parts.push_back(part);
  }

  /// Whether the middle of `cell` belongs to the surface, by the sides that a line to the right
  /// from there crosses.
  bool is_inside(const Outline& cell) const {
    glm::dvec2 middle(0);
    for (const glm::dvec2& p : cell) middle += p / static_cast<double>(cell.size());
    int crossed = 0;
    for (const Side& s : side_) {
      if ((s.from.y <= middle.y) == (s.to.y <= middle.y)) continue;
      const glm::dvec2 at = crossing(s.from, s.to, s.from.y - middle.y, s.to.y - middle.y);
      if (at.x > middle.x) crossed += s.to.y > s.from.y ? 1 : -1;
    }
    return crossed > 0;
  }

  std::span<const Side> side_;
  double tolerance_;
  std::size_t compared_ = 0;
  std::vector<Outline> piece_;
};

/// The triangles of a surface that are joined in one plane.
struct Plane {
  glm::dvec3 origin, normal, x, y;
  std::vector<std::uint32_t> triangle;

  double height(const glm::dvec3& p) const { return glm::dot(p - origin, normal); }
  glm::dvec2 at(const glm::dvec3& p) const {
    return {glm::dot(p - origin, x), glm::dot(p - origin, y)};
  }
};

/// A side by the positions of its ends: meshes have several vertices in one place.
using SideKey = std::pair<Float3, Float3>;

class Planes {
 public:
  Planes(const DisplayMesh& mesh, std::size_t most, std::size_t largest)
      : mesh_(mesh),
        tolerance_(ray_offset_distance(mesh.position) / 4),
        plane_of_(mesh.surface_count(), kNone) {
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      for (const SideKey& side : sides_of(t))
        by_side_.emplace_back(std::minmax(side.first, side.second), t);
    }
    std::ranges::sort(by_side_);
    std::vector<std::pair<double, std::uint32_t>> by_area;
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      const double area = area_of(corners_of(mesh, t));
      if (area > 0) by_area.emplace_back(-area, t);
    }
    // The largest first: its corners say best where the plane is.
    std::ranges::sort(by_area);
    for (const auto& [area, t] : by_area) {
      if (plane_of_[t] != kNone) continue;
      if (plane_.size() == most) {
        is_whole_ = false;
        plane_.resize(std::min(most, largest));
        return;
      }
      grow(t);
    }
  }

  Occluders take() const {
    Occluders occluders{.piece = {}, .is_whole = is_whole_};
    for (const Plane& plane : plane_) {
      if (!add_pieces(plane, occluders.piece)) occluders.is_whole = false;
    }
    return occluders;
  }

 private:
  std::array<SideKey, 3> sides_of(std::uint32_t t) const {
    const auto& [a, b, c] = mesh_.triangle[t];
    const std::vector<Float3>& p = mesh_.position;
    return {SideKey{p[a], p[b]}, SideKey{p[b], p[c]}, SideKey{p[c], p[a]}};
  }

  /// The triangles that have a side.
  template <typename Visit>
  void for_each_at(const SideKey& side, const Visit& visit) const {
    const SideKey key = std::minmax(side.first, side.second);
    auto at = std::ranges::lower_bound(by_side_, std::pair(key, 0U));
    for (; at != by_side_.end() && at->first == key; ++at) visit(at->second);
  }

  void grow(std::uint32_t first) {
    const auto corner = corners_of(mesh_, first);
    Plane plane{
        .origin = corner[0], .normal = front_normal(corner), .x = {}, .y = {}, .triangle = {}};
    plane.x = glm::normalize(corner[1] - corner[0]);
    plane.y = glm::cross(plane.normal, plane.x);
    const auto number = static_cast<std::uint32_t>(plane_.size());
    plane.triangle.push_back(first);
    plane_of_[first] = number;
    const bool solid = mesh_.opacity.of_triangle(first).empty();
    for (std::size_t k = 0; solid && k < plane.triangle.size(); ++k) {
      const std::array<SideKey, 3> sides = sides_of(plane.triangle[k]);
      for (const SideKey& side : sides) {
        for_each_at(side, [&](std::uint32_t t) {
          if (plane_of_[t] != kNone || !belongs_to(plane, t)) return;
          plane_of_[t] = number;
          plane.triangle.push_back(t);
        });
      }
    }
    plane_.push_back(std::move(plane));
  }

  bool belongs_to(const Plane& plane, std::uint32_t t) const {
    if (!mesh_.opacity.of_triangle(t).empty()) return false;
    const auto corner = corners_of(mesh_, t);
    return glm::dot(area_vector(corner), plane.normal) > 0 &&
           std::ranges::all_of(
               corner, [&](const glm::dvec3& p) { return std::abs(plane.height(p)) < tolerance_; });
  }

  /// The sides that no second triangle of the plane has the other way round.
  std::vector<Side> outline(const Plane& plane) const {
    std::map<SideKey, int> count;
    for (const std::uint32_t t : plane.triangle) {
      for (const SideKey& side : sides_of(t)) {
        const auto turned = count.find({side.second, side.first});
        if (turned == count.end() || turned->second == 0) {
          ++count[side];
        } else {
          --turned->second;
        }
      }
    }
    std::vector<Side> sides;
    for (const auto& [side, times] : count) {
      if (times > 0)
        sides.push_back({plane.at(to_dvec3(side.first)), plane.at(to_dvec3(side.second))});
    }
    return sides;
  }

  /// False if they do not cover the whole plane.
  bool add_pieces(const Plane& plane, std::vector<Occluder>& occluders) const {
    const bool solid = mesh_.opacity.of_triangle(plane.triangle[0]).empty();
    const std::vector<Side> sides = outline(plane);
    if (sides.empty()) return true;  // slivers that undo each other have no area
    ConvexPieces pieces(sides, tolerance_);
    for (const Outline& piece : pieces.take()) {
      // Fans of pieces with four corners, if there are more.
      for (std::size_t k = 1; k + 1 < piece.size(); k += 2) {
        const std::array<std::size_t, Occluder::kCorners> number{0, k, k + 1,
                                                                 std::min(k + 2, piece.size() - 1)};
        Occluder occluder{.corner = {}, .normal = plane.normal, .solid = solid};
        for (std::size_t c = 0; c < number.size(); ++c) {
          const glm::dvec2& at = piece[number[c]];
          occluder.corner[c] = plane.origin + at.x * plane.x + at.y * plane.y;
        }
        occluders.push_back(occluder);
      }
    }
    return pieces.is_whole();
  }

  const DisplayMesh& mesh_;
  double tolerance_;
  std::vector<std::pair<SideKey, std::uint32_t>> by_side_;
  std::vector<std::uint32_t> plane_of_;  ///< [triangles]
  std::vector<Plane> plane_;
  bool is_whole_ = true;
};

/// The lowest ten bits of `x`, with two zeros after each.
std::uint32_t spread_bits(std::uint32_t x) {
  std::uint32_t spread = 0;
  for (int bit = 0; bit < 10; ++bit) spread |= (x >> bit & 1U) << (3 * bit);
  return spread;
}

/// Along a Morton curve: neighbours come into one group.
void sort_by_place(std::vector<Occluder>& occluders) {
  const auto middle = [](const Occluder& occluder) {
    return 0.5F * (occluder.corner[0] + occluder.corner[2]);
  };
  Box box;
  for (const Occluder& occluder : occluders) box.add(middle(occluder));
  const glm::vec3 scale = 1023.0F / glm::max(box.extent(), glm::vec3(1e-20F));
  const auto key = [&](const Occluder& occluder) {
    // Extents may be infinite; what is then no number becomes 0.
    const glm::vec3 at = scale * (middle(occluder) - box.low);
    const glm::uvec3 cell(glm::max(glm::vec3(0), glm::min(at, glm::vec3(1023))));
    return spread_bits(cell.x) | spread_bits(cell.y) << 1 | spread_bits(cell.z) << 2;
  };
  std::ranges::stable_sort(occluders, {}, key);
}

}  // namespace

Occluders find_occluders(const DisplayMesh& mesh, std::size_t most, std::size_t largest) {
  Occluders occluders = Planes(mesh, most, largest).take();
  sort_by_place(occluders.piece);
  return occluders;
}

}  // namespace rebounce
