#pragma once

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A point light for a scene that has no light of its own: in free space, where it reaches much of
/// the surface and is not close to any of it. It sends out 100 lm for each m² of surface. The same
/// scene, the same light. `tracer` holds the scene's surface.
Light make_key_light(const TransferData& data, const RayTracer& tracer);

}  // namespace rebounce
