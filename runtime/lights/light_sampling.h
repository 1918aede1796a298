#pragma once

#include "rebounce/lights.h"

namespace rebounce {

/// Light from one lamp, or from one sample point of it, at one point, before cosine and shadow.
struct IncidentLight {
  Float3 direction{0, 0, 0};    ///< unit, from the point to the lamp
  float distance = 0;           ///< metres; infinite for directional lights
  Float3 illuminance{0, 0, 0};  ///< lx on a surface that faces the lamp; 0 beyond its range
};

/// True for lamps with a surface, whose light comes from many directions.
bool is_area_light(LightType type);

/// The length of a shadow ray to a lamp at `distance`. It ends a little before the lamp, which may
/// touch a surface. Infinite if `distance` is.
inline float shadow_ray_length(float distance) {
  constexpr float kLampGap = 1e-4F;
  return distance * (1 - kLampGap);
}

/// Evaluates `light` at `point`: inverse-square fall-off, range window and spot cone as in
/// KHR_lights_punctual, times the candelas of its profile if it has one.
///
/// For a lamp with a surface, `place` in [0, 1)² selects the sample point. The mean over all of
/// them of illuminance times cosine is the irradiance. The range window is that of the lamp's
/// centre.
IncidentLight evaluate_light(const Light& light, const Float3& point,
                             const Float2& place = {0.5F, 0.5F});

/// Checks the fields that the type of `light` uses against their ranges (rebounce/lights.h).
/// Throws Error that names the field.
void check_light(const Light& light);

}  // namespace rebounce
