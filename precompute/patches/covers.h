#pragma once

// Surfaces that others cover closely: the wall behind a panel, the floor under a rug or a curtain.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/lit_sides.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// A surface higher above another than this number of mean patch sizes does not cover it.
inline constexpr double kCoverHeight = 0.5;

/// The largest number of points of a triangle at which covers are searched.
inline constexpr std::uint32_t kMostCoverPoints = 16;

/// The fraction of the front of a triangle above which a surface lies within `height` metres, from
/// rays straight up at `count` of its points, 1 to kMostCoverPoints.
double covered_part(const TriangleCorners& corners, const RayTracer& tracer, double height,
                    std::uint32_t count);

/// A surface no higher above another than this number of mean patch sizes ends the smooth light on
/// it. Below a higher one the surface is visible (lab/023).
inline constexpr double kCloseCover = 1.0 / 32;

/// True if all of the front of a triangle is covered by surfaces no higher than `height` metres,
/// from a few of its points. A triangle that is covered in part shows the light beside the cover,
/// because its open part is the visible one.
bool is_covered(const TriangleCorners& corners, const RayTracer& tracer, double height);

/// Bisects triangles that are covered in part until they are small relative to a patch of
/// `patch_size` metres, so that patches can end about where covers end. `sides` [t] are those of
/// the triangles; only lit sides count. `tracer` holds the same surface. Adds at most about
/// `most_added` triangles. The mesh stays conforming. Returns for each triangle the one that it
/// came from; parts of one triangle follow each other. Deterministic.
std::vector<std::uint32_t> refine_at_covers(Scene& scene, std::span<const TriangleSides> sides,
                                            const RayTracer& tracer, double patch_size,
                                            std::size_t most_added);

}  // namespace rebounce
