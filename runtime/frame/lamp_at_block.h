#pragma once

// What one lamp does to one block of patches.

#include <cstddef>
#include <span>

#include "runtime/frame/receivers.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/shadow_volumes.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Adds the irradiance from `lamp` at intensity 1 to that of the slots of a block, in lx.
///
/// Shadows come from `volumes`, those of what stands in the scene: points in none of them see the
/// lamp, and points inside one that is wholly in the shadow see nothing of it. Rays tell of the
/// others: of points from which a lamp with a surface is hidden in part, and of those behind
/// something that lets light through. They also take the place of volumes where there are too many
/// of them in one place. `is_whole` tells whether `volumes` are all that stands in the scene;
/// otherwise rays look for the rest. Does not allocate.
void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const ShadowVolumes& volumes, bool is_whole, std::size_t block,
              std::span<float> irradiance);

}  // namespace rebounce
