#pragma once

#include <filesystem>
#include <vector>

#include "rebounce/transfer/scene_description.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce::cli {

struct LightSetup {
  std::vector<Light> lights;
  Sky sky;
};

/// Reads lights from a .json file (notes/light_file.md), or from a .glb or .gltf with
/// KHR_lights_punctual. Throws Error naming the file, the light and the field that is wrong.
LightSetup read_lights(const std::filesystem::path& path);

/// The lights of `path`, or those stored in the transfer file if `path` is empty. Throws Error if
/// there is no light at all: no lamp, no sky and no patch that emits.
LightSetup choose_lights(const std::filesystem::path& path, const TransferData& data);

}  // namespace rebounce::cli
