#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rebounce/lights.h"
#include "rebounce/sky.h"
#include "rebounce/types.h"

namespace rebounce {

/// The factor on the emission of a material.
struct EmitterScale {
  std::string material;
  Float3 scale{1, 1, 1};
};

struct LightSetup {
  std::vector<Light> lights;
  Sky sky;
  std::vector<EmitterScale> emitters;
};

/// Reads lights from a .json file (notes/reference/light_file.md), or from a .glb or .gltf with
/// KHR_lights_punctual. `scale` is the length of the unit of the .glb or .gltf in metres, > 0; a
/// .json file is in metres. Throws Error naming the file, the light and the field that is wrong.
LightSetup read_lights(const std::filesystem::path& path, double scale = 1);

}  // namespace rebounce
