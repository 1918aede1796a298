#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "precompute/import/scene.h"

namespace rebounce {

struct SubdivisionSettings {
  /// As many patches as are wanted; 0: as many as patch_size asks for. More patches: finer light,
  /// offline time and memory that grow with their square.
  std::size_t patch_count = 4096;
  /// No patch should be longer than this, in metres; 0: no such limit.
  float patch_size = 0;
};

/// A mesh of nothing but large triangles, bisected until there are enough, has no edge longer than
/// this many mean patch sizes.
inline constexpr double kLongestEdge = 2.9;

/// The root of the mean area of `patch_count` patches (at least one), metres.
/// `patches_per_triangle` as for subdivide().
double mean_patch_size(const Scene& scene, std::span<const std::uint8_t> patches_per_triangle,
                       std::size_t patch_count);

/// Splits the scene's triangles until there are as many elements as patches are wanted and none is
/// much larger than a mean patch (small triangles are merged afterwards: element_clusters.h), or
/// until no edge is longer than patch_size. Returns for each triangle the index of the triangle it
/// came from.
///
/// The longest edge of the whole scene is bisected over and over, in all triangles that share it
/// (edges are the same where their end points are, whatever their materials). Being the longest of
/// all, it is the longest of each of its triangles: this is Rivara's longest-edge bisection
/// (M.-C. Rivara, "Algorithms for refining triangular grids suitable for adaptive and multigrid
/// techniques", 1984), which keeps angles bounded, and it never makes a T-junction.
///
/// `patches_per_triangle` [t] is the number of patches that a triangle is worth (1, or 2 if both
/// of its sides are lit). Triangles that come from one keep its order, neighbours stay close.
///
/// `density_weight` [t] in (0, 1], or empty where all have 1: with `patch_count`, an edge of
/// triangles of density_weight w counts as long as its length x √w, so that their parts become
/// larger than others. Then an edge that is to be split may not be the longest of its triangles,
/// and those are split first (longest_edges.h).
std::vector<std::uint32_t> subdivide(Scene& scene,
                                     std::span<const std::uint8_t> patches_per_triangle,
                                     const SubdivisionSettings& settings,
                                     std::span<const float> density_weight = {});

}  // namespace rebounce
