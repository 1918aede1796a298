#pragma once

// A lightmap of a scene that was unwrapped for one: where each of its texels lies on the surface.

#include <cstdint>
#include <string>
#include <vector>

#include "precompute/patches/patch_model.h"
#include "transfer/data/lightmap.h"

namespace rebounce {

/// The sides that a lightmap may have, texels.
inline constexpr std::uint32_t kSmallestLightmap = 16, kLargestLightmap = 4096;

struct LightmapSettings {
  /// Texels along each side; 0: no lightmap. More: sharper; the file grows by 12 bytes a texel.
  std::uint32_t size = 0;
  /// Texels by which charts are continued beyond their rim. More: safe for more levels of a
  /// mip-map; charts that lie closer to each other share what is between them.
  std::uint32_t padding = 4;
};

struct PlacedLightmap {
  Lightmap lightmap;
  std::vector<std::string> warnings;  ///< one line for each mesh that was left out
};

/// Makes the lightmap of `model`, whose assets' second texture coordinates must unwrap every mesh
/// without overlap into [0, 1]². The pages of all meshes, each as often as it is placed, share one
/// square texture, so that all have about as many texels to the square metre.
///
/// A mesh is left out, with a warning, if its coordinates leave [0, 1] or more than 1 % of what
/// they cover is covered twice: surfaces would show the light of others. Of a double-sided triangle
/// the front has texels, or the back if the front sees nothing.
///
/// Throws Error if a setting is out of range, no mesh can have a lightmap, or there is not room for
/// all of them.
PlacedLightmap place_lightmap(const PatchModel& model, const LightmapSettings& settings);

}  // namespace rebounce
