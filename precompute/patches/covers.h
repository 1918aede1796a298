#pragma once

// Surfaces that others lie close above: the wall behind a panel, the floor under a rug or a
// curtain.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/lit_sides.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// What hangs higher above a surface than this many mean patch sizes does not cover it.
inline constexpr double kCoverHeight = 0.5;

/// Points of a triangle at which covers are looked for, at most.
inline constexpr std::uint32_t kMostCoverPoints = 16;

/// The part of a triangle's front above which something lies within `height` metres, as rays
/// straight up from `count` of its points have it: from 1 to kMostCoverPoints.
double covered_part(const TriangleCorners& corners, const RayTracer& tracer, double height,
                    std::uint32_t count);

/// What hangs no higher above a surface than this many mean patch sizes ends the smooth light on
/// it. Under what hangs higher one can see.
inline constexpr double kCloseCover = 1.0 / 32;

/// Whether all of a triangle's front is covered by what hangs no higher than `height` metres, as a
/// few points of it have it. What is covered in part shows the light beside the cover: it is what
/// stands out from under it that is seen.
bool is_covered(const TriangleCorners& corners, const RayTracer& tracer, double height);

/// Bisects triangles of which a part is covered and a part is in the open, until they are small
/// beside a patch of `patch_size` metres: so patches can end about where covers do, whatever these
/// are made of. `sides` [t] are those of the triangles, and only those that are lit count; `tracer`
/// holds the same surface. Adds no more than about `most_added` triangles. The mesh stays
/// conforming. Returns for each triangle the one it came from, those of one following each other.
/// Deterministic.
std::vector<std::uint32_t> refine_at_covers(Scene& scene, std::span<const TriangleSides> sides,
                                            const RayTracer& tracer, double patch_size,
                                            std::size_t most_added);

}  // namespace rebounce
