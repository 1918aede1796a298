#pragma once

// The fraction of their view over which surfaces exchange light: outer walls see almost nothing of
// the scene.

#include <cstdint>

#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// The fraction of `count` cosine-distributed rays from the front of a triangle that meet a
/// surface.
double hemisphere_visibility(const TriangleCorners& corners, const RayTracer& tracer,
                             std::uint32_t count, std::uint64_t seed);

/// The weight of a surface in the distribution of patches, relative to the same area inside a room,
/// in (0, 1]: 1 if it sees surfaces in at least a quarter of its view, less in proportion if it
/// sees less.
double density_weight(double hemisphere_visibility);

}  // namespace rebounce
