#pragma once

// How much of their view surfaces exchange light with: outer walls see next to nothing of the
// scene.

#include <cstdint>

#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// The part of `count` cosine-distributed rays from a triangle's front that meet a surface.
double hemisphere_visibility(const TriangleCorners& corners, const RayTracer& tracer,
                             std::uint32_t count, std::uint64_t seed);

/// What a surface counts for where patches are shared out, against the same area inside of a room:
/// 1 if it sees surfaces in a quarter of its view or more, less where it sees less, and in
/// proportion. In (0, 1].
double density_weight(double hemisphere_visibility);

}  // namespace rebounce
