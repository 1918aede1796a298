#pragma once

#include <vector>

#include "rebounce/precompute/lit_sides.h"

namespace rebounce {

/// Makes lit sides of double-sided triangles kBuried that are inside of a closed shell: a cushion,
/// a bottle, a cupboard. Nothing there can be seen, yet such insides hold up to a third of the area
/// of a furnished room, and where they are white the least leak fills them with light.
///
/// Diffuse paths are followed from each side, on from where they meet something, of which half end
/// at every bounce: so a wall that closes a shell, or passes through it, is inside where it is. A
/// path is out where it meets no surface within 1.5 m or a quarter of the scene's diagonal, or one
/// that emits; a side of whose paths no more than 4 % get out is inside. So a shell may have
/// cracks, and a room is none. Four paths tell of most sides that they are not inside, and 64 that
/// eight close together are; up to 128 are followed only where that is in doubt.
///
/// `scene`, `tracer` and `sides` [t] as for find_lit_sides(). Deterministic.
void bury_enclosed_sides(const Scene& scene, const RayTracer& tracer,
                         std::vector<TriangleSides>& sides);

}  // namespace rebounce
