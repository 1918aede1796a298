#pragma once

// Patches as sets of display triangles, and points spread over them.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// The display triangles of each patch, in ascending order.
class PatchTriangles {
 public:
  /// `triangle_patch` [t] is the patch of each display triangle, or kNone; others are <
  /// `patch_count`.
  PatchTriangles(std::span<const std::uint32_t> triangle_patch, std::size_t patch_count);

  std::size_t patch_count() const { return begin_.size() - 1; }
  std::span<const std::uint32_t> operator[](std::size_t patch) const {
    return {triangle_.data() + begin_[patch], triangle_.data() + begin_[patch + 1]};
  }

 private:
  std::vector<std::uint32_t> begin_;     ///< [n + 1]
  std::vector<std::uint32_t> triangle_;  ///< those of patch i at [begin_[i], begin_[i + 1])
};

/// A point on a side of the surface.
struct PatchPoint {
  Float3 position{0, 0, 0};  ///< metres
  Float3 normal{0, 0, 0};    ///< unit, of the flat triangle
};

/// Writes points spread evenly by area over `triangles` of `mesh`: the R2 sequence, shifted by
/// `shift`, whose first coordinate also chooses the triangle. Every prefix is well spread. Where
/// the triangles have no area the points have no normal.
void spread_points(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                   const glm::dvec2& shift, std::span<PatchPoint> points);

}  // namespace rebounce
