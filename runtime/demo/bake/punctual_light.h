#pragma once

#include "rebounce/lights.h"

namespace rebounce {

/// The closest light of KHR_lights_punctual to `light`, for programs that know no others. A lamp
/// with a surface becomes a point light, or a spot light over its half-space, with the same
/// intensity straight ahead from afar. A luminaire with a profile becomes a light with its mean
/// intensity in all directions. Other lights are returned unchanged.
Light punctual_equivalent(const Light& light);

}  // namespace rebounce
