#pragma once

#include "precompute/patches/patch_model.h"
#include "rebounce/build_settings.h"

namespace rebounce {

/// Throws Error if a setting is out of its range, whatever the scene.
void check_settings(const BuildSettings& settings);

/// The settings with what was left open decided for a scene of these patches. Throws Error if they
/// contradict each other.
BuildSettings decide(BuildSettings settings, const PatchModel& model);

/// BuildSettings::lights, which must be there. Throws Error if one is out of range.
const std::vector<Light>& own_lights(const BuildSettings& settings);

}  // namespace rebounce
