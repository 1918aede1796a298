#pragma once

#include "rebounce/transfer/scene_description.h"

namespace rebounce {

/// Light from one lamp at one point, before cosine and shadow.
struct IncidentLight {
  Float3 direction{0, 0, 0};  ///< unit, from the point to the lamp
  float distance = 0;         ///< metres; infinite for directional lights
  Float3 illuminance{0, 0,
                     0};  ///< lx on a surface that faces the lamp; 0: the lamp is out of reach
};

/// Evaluates `light` at `point`: inverse-square fall-off, range window and spot cone as
/// KHR_lights_punctual defines them.
IncidentLight evaluate_light(const Light& light, const Float3& point);

}  // namespace rebounce
