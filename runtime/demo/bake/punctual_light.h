#pragma once

#include "transfer/data/scene_description.h"

namespace rebounce {

/// The light of KHR_lights_punctual that comes nearest to `light`, for what knows no others: a
/// lamp with a surface as a point, or a spot over its half-space, of the same intensity from afar
/// straight ahead; a luminaire with a profile as one that gives off its mean in
/// all directions. Others are as they are.
Light punctual_equivalent(const Light& light);

}  // namespace rebounce
