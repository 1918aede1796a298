#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "precompute/cli/console.h"
#include "precompute/import/light_file.h"
#include "rebounce/engine.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::cli {

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
