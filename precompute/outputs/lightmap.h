#pragma once

// A lightmap for a scene that is unwrapped for one: the place of each texel on the surface.

#include <cstdint>
#include <string>
#include <vector>

#include "precompute/patches/patch_model.h"
#include "rebounce/build_settings.h"
#include "rebounce/scene_data.h"

namespace rebounce {

struct PlacedLightmap {
  Lightmap lightmap;
  std::vector<std::string> warnings;  ///< one line for each mesh that is left out
};

/// Makes the lightmap of `model`. The second texture coordinates of its assets must unwrap every
/// mesh without overlap into [0, 1]². The pages of all meshes, one for each placement, share one
/// square texture, so that all have about the same number of texels per square metre.
///
/// A mesh is left out, with a warning, if its coordinates leave [0, 1] or more than 1 % of what
/// they cover is covered twice: surfaces would show the light of others. For a double-sided
/// triangle the front has texels, or the back if the front sees nothing.
///
/// Throws Error if a setting is out of range, no mesh can have a lightmap, or there is not enough
/// room for all of them.
PlacedLightmap place_lightmap(const PatchModel& model, const LightmapSettings& settings);

}  // namespace rebounce
