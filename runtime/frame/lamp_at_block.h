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
/// lamp, and points inside one that is wholly in the shadow see nothing of it. From the others a
/// lamp with a surface may be hidden in part: places on it are looked at, past the occluders in
/// whose volumes the point lies. Rays tell of points behind something that lets light through, and
/// where there are too many volumes in one place. `occluders` are those that `volumes` belong to;
/// if they are not all that stands in the scene, rays look for the rest. Does not allocate.
void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const OccluderGroups& occluders, const ShadowVolumes& volumes, std::size_t block,
              std::span<float> irradiance);

}  // namespace rebounce
