#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "precompute/cli/console.h"
#include "rebounce/engine.h"
#include "rebounce/lights.h"
#include "rebounce/sky.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

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
/// KHR_lights_punctual. Throws Error naming the file, the light and the field that is wrong.
LightSetup read_lights(const std::filesystem::path& path);

/// The lights of `path`, or those stored in the transfer file if `path` is empty. Throws Error if
/// there is no light at all: no lamp, no sky and no patch that emits.
LightSetup choose_lights(const std::filesystem::path& path, const TransferData& data);

/// Loads a transfer file, with the emission of its materials scaled as the light file says, and the
/// lights that choose_lights finds. Throws Error if a material is not in the scene.
std::shared_ptr<const TransferData> load_lit_scene(const std::filesystem::path& file,
                                                   const std::filesystem::path& lights,
                                                   LightSetup& setup);

/// Prints a warning for each of `lights` that lights nothing or stands in a wall (lamp_warnings).
void warn_of_lamps(const Engine& engine, std::span<const Light> lights,
                   const CommonOptions& options);

}  // namespace rebounce::cli
