#pragma once

// Merges small triangles into patches.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/patches/elements.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The assignment of elements to patches.
struct ElementPatches {
  std::vector<std::uint32_t> patch;  ///< of each element
  std::size_t patch_count = 0;
};

struct ClusterSettings {
  /// Merging stops at this number of patches.
  std::size_t patch_count = 0;
  /// Limit of the length of a patch, metres; 0: no limit.
  float largest = 0;
};

/// Merges elements into patches, the pair of least cost first. The cost of a pair is the increase
/// of the deviation of its elements from the mean of their patch, in position, normal, reflectance
/// and covered fraction (covers.h), summed over area times density_weight (J. H. Ward,
/// "Hierarchical grouping to optimize an objective function", 1963; over the dual graph of the mesh
/// as in M. Garland, A. Willmott and P. S. Heckbert, "Hierarchical face clustering on polygonal
/// surfaces", 2001). A patch is therefore small where surfaces turn or change colour, and detail
/// far smaller than a patch becomes one patch.
///
/// Pairs are neighbours over an edge; elements that lie near each other without a shared edge
/// (leaves, slats); and, once none of these is left, patches that lie near each other. An
/// element that emits and one that does not never merge.
///
/// The leak test keeps a patch from lying on two sides of a wall or in two rooms. Lines of sight
/// join the elements of a pair. If a piece of mesh longer than half a mean patch blocks most of
/// them, merging costs as if the two were eight mean patches apart, times the smaller area.
/// Fragments then join others through walls before large open patches grow, and larger clusters
/// rarely do. Small pairs may hide themselves (the far side of the leg of a table) at no cost, and
/// pairs far smaller than a patch merge without the test. No patch is longer than four mean ones,
/// unless there would be too many.
///
/// If there are many more elements than patches, they are first merged in blocks of neighbours, on
/// all threads, to clusters far smaller than patches.
///
/// `tracer` holds the surface. Patches are numbered in the order of their first elements. The
/// result is the same for any number of threads. Throws Cancelled if asked to stop.
ElementPatches merge_elements(const Elements& elements, const RayTracer& tracer,
                              const ClusterSettings& settings, const Progress& progress = {});

}  // namespace rebounce
