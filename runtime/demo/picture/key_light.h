#pragma once

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A point light for a scene without lights, in free space, where it reaches much of what the
/// default camera sees and of what sees little of the sky, and is not close to any surface. It
/// emits 100 lm per m² of surface. The same scene gives the same light. `tracer` holds the surface
/// of the scene.
Light make_key_light(const TransferData& data, const RayTracer& tracer);

}  // namespace rebounce
