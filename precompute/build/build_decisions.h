#pragma once

#include "precompute/patches/patch_model.h"
#include "rebounce/build_settings.h"

namespace rebounce {

/// The settings with what was left open decided for a scene of these patches. Throws Error if they
/// contradict each other.
BuildSettings decide(BuildSettings settings, const PatchModel& model);

}  // namespace rebounce
