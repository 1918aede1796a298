#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "rebounce/error.h"
#include "rebounce/types.h"

namespace rebounce {

/// The most triangles of a mesh: their sides are numbered by 32 bits.
inline constexpr std::size_t kMostTriangles = std::numeric_limits<std::uint32_t>::max() / 3;

/// Throws Error if a mesh has more than kMostTriangles.
inline void check_triangle_count(std::size_t count) {
  if (count <= kMostTriangles) return;
  throw Error("a mesh may have at most " + std::to_string(kMostTriangles) + " triangles, not " +
              std::to_string(count) + "; simplify the scene or ask for fewer or larger patches");
}

/// One side of a triangle, stored with the edge that it lies on.
class HalfEdge {
 public:
  HalfEdge() = default;
  HalfEdge(std::uint32_t high, std::uint32_t triangle, bool ascends)
      : high_(high), triangle_(2 * triangle + (ascends ? 1 : 0)) {}

  std::uint32_t high() const { return high_; }  ///< the end of the edge with the higher number
  std::uint32_t triangle() const { return triangle_ / 2; }
  /// True if it runs from the lower end to the higher.
  bool ascends() const { return triangle_ % 2 == 1; }

  void set_triangle(std::uint32_t triangle) { triangle_ = 2 * triangle + triangle_ % 2; }

  bool operator<(const HalfEdge& other) const {
    return high_ != other.high_ ? high_ < other.high_ : triangle_ < other.triangle_;
  }

 private:
  std::uint32_t high_ = 0, triangle_ = 0;
};

/// The edges of a triangle mesh, found by the numbers of their ends. Takes 8 bytes for each side of
/// each triangle.
class EdgeTable {
 public:
  EdgeTable() = default;

  /// Triangles [0, `count`) have the corners corner(t), all below `end_count`. Sides without length
  /// are left out. Throws Error if there are more than kMostTriangles.
  template <typename Corner>
  EdgeTable(std::size_t count, std::uint32_t end_count, const Corner& corner)
      : begin_(std::size_t{end_count} + 1, 0) {
    check_triangle_count(count);
    for_each_side(count, corner, [&](std::uint32_t low, HalfEdge) { ++begin_[low + 1]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    half_edge_.resize(begin_.back());
    for_each_side(count, corner,
                  [&](std::uint32_t low, HalfEdge edge) { half_edge_[begin_[low]++] = edge; });
    std::copy_backward(begin_.begin(), begin_.end() - 1, begin_.end());
    begin_.front() = 0;
#pragma omp parallel for schedule(static, 4096)
    for (std::uint32_t low = 0; low < end_count; ++low) {
      std::sort(around(low).begin(), around(low).end());
    }
  }

  /// Runs visit(low, half-edges) for every edge, in ascending order of its ends; triangles ascend.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (std::uint32_t low = 0; low + 1 < begin_.size(); ++low) {
      const std::span<const HalfEdge> all(half_edge_.data() + begin_[low],
                                          half_edge_.data() + begin_[low + 1]);
      for (std::size_t first = 0, last = 0; first < all.size(); first = last) {
        while (last < all.size() && all[last].high() == all[first].high()) ++last;
        visit(low, all.subspan(first, last - first));
      }
    }
  }

  bool has_end(std::uint32_t end) const {
    return std::size_t{end} + 1 < begin_.size();
  }

  /// The triangles at the edge between two ends, `low` < `high`; empty if there is no such edge.
  std::span<HalfEdge> find(std::uint32_t low, std::uint32_t high) {
    const std::span<HalfEdge> all = around(low);
    return {std::ranges::lower_bound(all, high, {}, &HalfEdge::high),
            std::ranges::upper_bound(all, high, {}, &HalfEdge::high)};
  }
  std::span<const HalfEdge> find(std::uint32_t low, std::uint32_t high) const {
    return const_cast<EdgeTable*>(this)->find(low, high);
  }

 private:
  template <typename Corner, typename Visit>
  static void for_each_side(std::size_t count, const Corner& corner, const Visit& visit) {
    for (std::uint32_t t = 0; t < count; ++t) {
      const Uint3 ends = corner(t);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = ends[k], b = ends[(k + 1) % 3];
        if (a != b) visit(std::min(a, b), HalfEdge(std::max(a, b), t, a < b));
      }
    }
  }

  std::span<HalfEdge> around(std::uint32_t low) {
    return {half_edge_.data() + begin_[low], half_edge_.data() + begin_[low + 1]};
  }

  std::vector<std::uint32_t> begin_;  ///< first half-edge of each lower end, in half_edge_
  std::vector<HalfEdge> half_edge_;
};

}  // namespace rebounce
