#pragma once

// Small triangles merged into patches.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/patches/elements.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Elements as patches.
struct ElementPatches {
  std::vector<std::uint32_t> patch;  ///< of each element
  std::size_t patch_count = 0;
};

struct ClusterSettings {
  /// Merge until no more than this many patches are left.
  std::size_t patch_count = 0;
  /// Do not merge what would be longer than this, in metres; 0: no such limit.
  float largest = 0;
};

/// Merges elements into patches, the cheapest pair first: what a pair costs is how much more its
/// elements differ from the mean of their patch, in position, normal, reflectance and the part that
/// is covered (covers.h), summed over their area times density_weight (J. H. Ward, "Hierarchical
/// grouping to optimize an objective function", 1963; over the dual graph of the mesh as in M.
/// Garland, A. Willmott, P. S. Heckbert, "Hierarchical face clustering on polygonal surfaces",
/// 2001). So a patch is small where surfaces turn or change colour, and detail far smaller than a
/// patch is taken as a whole.
///
/// Pairs are neighbours over an edge; elements that lie near each other without an edge between
/// (leaves, slats); and once none of those is left, patches that lie near each other. Emitting and
/// other elements are never merged.
///
/// The leak test keeps patches from lying on two sides of a wall or in two rooms: lines of sight
/// are drawn between the elements of both of a pair, and where most are blocked by a piece of mesh
/// that is longer than half of a mean patch, merging costs as if the two were eight mean patches
/// apart, times the area at stake. So fragments join others through walls before what is open
/// grows, and larger ones hardly ever do. Small pairs may hide themselves (the far side of a
/// table's leg) at no cost, and what is far smaller than a patch merges without the test. No patch
/// is longer than four mean ones, unless there would be too many.
///
/// Where there are many more elements than patches they are first merged in blocks of neighbours,
/// on all threads, to clusters that are far smaller than patches.
///
/// `tracer` holds the surface. Patches are numbered in the order of their first elements.
/// Deterministic for any number of threads. Throws Cancelled.
ElementPatches merge_elements(const Elements& elements, const RayTracer& tracer,
                              const ClusterSettings& settings, const Progress& progress = {});

}  // namespace rebounce
