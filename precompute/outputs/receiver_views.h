#pragma once

// What patches and vertices of the display mesh see, along rays.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/hit_patch.h"
#include "rebounce/engine.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/base/grouped.h"

namespace rebounce {

/// A sparse row: with radiosities B in lx the light at a place is the sum of part x B[source],
/// in lx. Sources are patches, or parts of them.
struct ViewEntry {
  std::uint32_t source;
  float part;
};
using ViewRow = std::vector<ViewEntry>;  ///< by ascending source

/// Finds rows of places on a mesh, one after the other. The same place gives the same row.
class ReceiverViewer {
 public:
  /// `shown_patch` [t] is that of PatchModel; patches are below `patch_count`. `point`
  /// [patch_count][K] are the receiver_points by which patches have parts (ReceiverRows). All must
  /// outlive it.
  ReceiverViewer(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                 std::size_t patch_count, std::span<const ReceiverPoint> point,
                 const RayTracer& tracer, int ray_count);

  /// The mean over a patch of `triangles`, by patches.
  void look_from_patch(std::span<const std::uint32_t> triangles, ViewRow& row);

  /// The value that the light on the `triangles` around a vertex gives it: that of the linear
  /// function over each of them which is nearest to the light there. Places count by how much they
  /// are seen from farther away than `sight` metres: the part of a wall that stands out from under
  /// a cornice shows its own light, not that of the slot behind. By parts of patches: K i + k is
  /// part k of patch i.
  void look_from_vertex(std::uint32_t vertex, std::span<const std::uint32_t> triangles,
                        double sight, ViewRow& row);

 private:
  void trace();
  /// Replaces places that are not seen by those that are; returns the part that is.
  double keep_seen(double sight);
  /// The part of a patch that is nearest to where a ray ends.
  std::uint32_t part_at(std::uint32_t patch, const Hit& hit, double sight) const;
  void add(std::uint32_t source, double part);
  void take(ViewRow& row);

  const DisplayMesh& mesh_;
  std::span<const std::uint32_t> shown_patch_;
  std::span<const ReceiverPoint> part_point_;  ///< [n][K]
  std::size_t parts_;                          ///< K
  const RayTracer& tracer_;
  std::vector<PatchPoint> point_;  ///< [rays]
  std::vector<double> height_;     ///< [rays] of the vertex's hat function where they begin
  std::vector<Ray> ray_;
  std::vector<Hit> hit_;
  std::vector<double> sum_;             ///< [n K] of the row that is made
  std::vector<std::uint32_t> touched_;  ///< patches or parts of which it may have something
  CoincidenceScratch scratch_;
};

}  // namespace rebounce
