#pragma once

#include "transfer/data/scene_description.h"

namespace rebounce {

/// Light from one lamp, or from one place of it, at one point, before cosine and shadow.
struct IncidentLight {
  Float3 direction{0, 0, 0};    ///< unit, from the point to the lamp
  float distance = 0;           ///< metres; infinite for directional lights
  Float3 illuminance{0, 0, 0};  ///< lx on a surface that faces the lamp; 0: it is out of reach
};

/// True for lamps that have a surface, whose light comes from many directions.
bool is_area_light(LightType type);

/// How far along the way to a lamp at `distance` a shadow ray goes: it ends a little before the
/// lamp, which may hang on a surface or lie on one. Infinite if `distance` is.
inline float shadow_ray_length(float distance) {
  constexpr float kLampGap = 1e-4F;
  return distance * (1 - kLampGap);
}

/// Evaluates `light` at `point`: inverse-square fall-off, range window and spot cone as
/// KHR_lights_punctual defines them, times the candelas of its profile if it has one.
///
/// Of a lamp with a surface, `place` in [0, 1)² is where the light comes from; the mean over all
/// places of illuminance times cosine is its irradiance. The range window is then that of the
/// lamp's middle.
IncidentLight evaluate_light(const Light& light, const Float3& point,
                             const Float2& place = {0.5F, 0.5F});

/// Checks the fields of `light` that its type uses against their ranges (scene_description.h).
/// Throws Error that names the field.
void check_light(const Light& light);

}  // namespace rebounce
