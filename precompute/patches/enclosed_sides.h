#pragma once

#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/triangle_sides.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Makes lit sides of double-sided triangles kBuried that are inside of a closed shell: a cushion,
/// a bottle, a cupboard. Nothing there can be seen, yet such insides hold up to a third of the area
/// of a furnished room, and where they are white the least leak fills them with light.
///
/// Diffuse paths are followed from each side, on from where they meet something; at every bounce
/// what the surface reflects of them goes on, but half at least: so a wall that closes a shell, or
/// passes through it, is inside where it is, and the crevices of a white sofa are lit. A path is
/// out where it meets no surface within 1.5 m or a quarter of the scene's diagonal, or one that
/// emits; a side of whose paths no more than 4 % get out is inside. So a shell may have cracks, and
/// a room is none.
///
/// Up to sixteen sides close together are judged by 16 paths of theirs where these say that they
/// are lit, by 64 where they are alike; only those that differ from the others, or are in between,
/// by up to 128 of their own, by 32 where they are tiny.
///
/// `scene`, `tracer` and `sides` [t] as for find_lit_sides(). Deterministic. Throws Cancelled.
void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides, const Progress& progress);

}  // namespace rebounce
