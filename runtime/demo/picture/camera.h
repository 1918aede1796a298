#pragma once

#include <span>

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A camera at `position` that looks at `target`, +Y upwards in the picture (+Z where it looks
/// straight up or down). `vertical_fov` in radians. Throws Error if the two points coincide or the
/// angle is not in (0, pi).
Camera look_at(const Float3& position, const Float3& target, float vertical_fov);

/// A view for a scene without a camera: level, from inside a room or through its open side. Of a
/// few hundred candidates it returns the one that sees the most surface, in the most directions,
/// through the fewest culled faces, and mostly lit. `radiosity` [n] is in lx; it may be empty.
/// `tracer` holds the surface of the scene. The same scene and light give the same view.
Camera fit_camera(const TransferData& data, const RayTracer& tracer,
                  std::span<const Float3> radiosity = {});

}  // namespace rebounce
