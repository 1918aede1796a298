#pragma once

#include <vector>

#include "precompute/base/progress.h"
#include "precompute/import/scene.h"
#include "precompute/patches/triangle_sides.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Marks lit sides of double-sided triangles kBuried if they are inside a closed shell: a cushion,
/// a bottle, a cupboard. Nothing in there is visible, but such sides are up to a third of the area
/// of a furnished room, and if they are white the smallest leak fills them with light.
///
/// Diffuse paths start from each side and continue at each hit. At every bounce the reflected
/// fraction continues, but at least half: a wall that closes a shell, or passes through it, is
/// therefore inside only there, and the crevices of a white sofa are lit. A path is outside if it
/// meets no surface within 1.5 m or a quarter of the diagonal of the scene, or a surface that
/// emits. A side is inside if at most 4 % of its paths are outside. A shell may therefore have
/// cracks, and a room is no shell.
///
/// Up to sixteen sides close together are tested together: by 16 paths in all if these show that
/// they are lit, by 64 if the sides are alike. Only sides that differ from the others, or are in
/// between, get up to 128 paths of their own; tiny ones are decided by 32 unless they had as many
/// before.
///
/// `scene`, `tracer` and `sides` [t] are those of find_lit_sides(). Deterministic. Throws Cancelled
/// if asked to stop.
void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides, const Progress& progress);

}  // namespace rebounce
