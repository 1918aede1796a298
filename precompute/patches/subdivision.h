#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "precompute/import/scene.h"
#include "rebounce/build_settings.h"

namespace rebounce {

/// After bisection, a mesh of large triangles has no edge longer than this number of mean patch
/// sizes.
inline constexpr double kLongestEdge = 2.9;

/// The square root of the mean area of `patch_count` patches (at least one), metres.
/// `patches_per_triangle` is that of subdivide().
double mean_patch_size(const Scene& scene, std::span<const std::uint8_t> patches_per_triangle,
                       std::size_t patch_count);

/// Splits triangles of the scene until there are as many elements as wanted patches and none is
/// much larger than a mean patch (small triangles are merged later: element_clusters.h), or until
/// no edge is longer than patch_size. Returns for each triangle the index of the triangle that it
/// came from.
///
/// The longest edge of the whole scene is bisected again and again, in all triangles that share it
/// (edges are equal if their end points are, whatever their materials). It is then the longest edge
/// of each of its triangles: this is longest-edge bisection (M.-C. Rivara, "Algorithms for refining
/// triangular grids suitable for adaptive and multigrid techniques", 1984), which keeps angles
/// bounded and never makes a T-junction.
///
/// `patches_per_triangle` [t] is the number of patches that a triangle counts for (1, or 2 if both
/// of its sides are lit). Parts of one triangle keep its order, and neighbours stay close.
///
/// `density_weight` [t] in (0, 1], empty if all are 1, applies with `patch_count`: an edge of
/// triangles of density_weight w counts as long as its length x √w, so that their parts become
/// larger than others. An edge may then not be the longest of its triangles; the longer ones are
/// split first (longest_edges.h).
std::vector<std::uint32_t> subdivide(Scene& scene,
                                     std::span<const std::uint8_t> patches_per_triangle,
                                     const SubdivisionSettings& settings,
                                     std::span<const float> density_weight = {});

}  // namespace rebounce
