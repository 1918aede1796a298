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
/// Shadows come from `volumes`, those of all that stands in the scene: what they hide or leave free
/// as a whole needs no ray. Points of patches are compared with the volumes of lamps without a
/// surface; where a lamp with a surface is hidden in part, rays to its sample points tell how much.
/// Rays also take the place of volumes where there are too many in one place, or where light may
/// get through, and everywhere if `volumes` is null. Does not allocate.
void add_lamp(const Receivers& receivers, const RayTracer& tracer, const PreparedLight& lamp,
              const ShadowVolumes* volumes, std::size_t block, std::span<float> irradiance);

}  // namespace rebounce
