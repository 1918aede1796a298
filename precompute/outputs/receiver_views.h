#pragma once

// What patches, vertices of the display mesh and single points see, along rays.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/hit_patch.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/base/grouped.h"

namespace rebounce {

/// A sparse row: with radiosities B in lx the light at a place is the sum of part x B[patch], in
/// lx.
struct ViewEntry {
  std::uint32_t patch;
  float part;
};
using ViewRow = std::vector<ViewEntry>;  ///< by ascending patch

/// Finds rows of places on a mesh, one after the other. The same place gives the same row.
class ReceiverViewer {
 public:
  /// `shown_patch` [t] is that of PatchModel; patches are below `patch_count`. All must outlive it.
  ReceiverViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                 std::size_t patch_count, const RayTracer& tracer, int ray_count);

  /// The mean over a patch of `triangles`.
  void look_from_patch(std::span<const std::uint32_t> triangles, ViewRow& row);

  /// The value that the light on the `triangles` around a vertex gives it: that of the linear
  /// function over each of them which is nearest to the light there. Places count by how much they
  /// are seen from farther away than `sight` metres: the part of a wall that stands out from under
  /// a cornice shows its own light, not that of the slot behind.
  void look_from_vertex(std::uint32_t vertex, std::span<const std::uint32_t> triangles,
                        double sight, ViewRow& row);

  /// The light at a point of the surface, as the unit vector `shading_normal` receives it, which is
  /// less than 90 degrees from that of the surface. Directions below the surface are mirrored at
  /// it. A point of which many rays meet backs, as on a floor below a box, sees nothing.
  void look_from_point(const PatchPoint& point, const Float3& shading_normal, ViewRow& row);

 private:
  /// Follows one ray of the hemisphere from each point.
  void trace();
  void intersect();
  /// Replaces places that are not seen by those that are; returns the part that is.
  double keep_seen(double sight);
  void add(std::uint32_t patch, double part);
  void take(ViewRow& row);

  const DisplayMesh& mesh_;
  std::span<const std::uint32_t> shown_patch_;
  const RayTracer& tracer_;
  std::vector<PatchPoint> point_;  ///< [rays]
  std::vector<double> height_;     ///< [rays] of the vertex's hat function where they begin
  std::vector<Ray> ray_;
  std::vector<Hit> hit_;
  std::vector<double> sum_;             ///< [n] of the row that is made
  std::vector<std::uint32_t> touched_;  ///< patches of which it may have something
  CoincidenceScratch scratch_;
};

}  // namespace rebounce
