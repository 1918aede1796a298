#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "precompute/import/scene.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// True if a triangle with these corners, a part of the original triangle `source`, is to be
/// bisected. It is called from many threads.
using IsCoarse = std::function<bool(const TriangleCorners& corners, std::uint32_t source)>;

/// Bisects the triangles that are coarse until none is, the largest ones first. Adds at most about
/// `most_added` triangles. The mesh stays conforming and its angles bounded (longest_edges.h).
/// Returns for each triangle the one that it came from; parts of one triangle follow each other.
/// Deterministic.
std::vector<std::uint32_t> refine_where(Scene& scene, const IsCoarse& is_coarse,
                                        std::size_t most_added);

/// The length of the longest edge of a triangle, metres.
double longest_edge_length(const TriangleCorners& corners);

}  // namespace rebounce
