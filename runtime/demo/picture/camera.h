#pragma once

#include "rebounce/scene_data.h"

namespace rebounce {

/// A camera at `position` that looks at `target`, +Y upwards in the picture (+Z where it looks
/// straight up or down). `vertical_fov` in radians. Throws Error if the two points coincide or the
/// angle is not in (0, pi).
Camera look_at(const Float3& position, const Float3& target, float vertical_fov);

}  // namespace rebounce
