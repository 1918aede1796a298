#pragma once

#include <filesystem>
#include <string>

#include "precompute/build/build.h"
#include "precompute/patches/patch_model.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

/// Loads a transfer file, or builds its data from a scene. Throws Error if it cannot.
TransferData load_or_build(const std::string& input, const BuildSettings& settings);

/// The patches of a scene, made as load_or_build makes them. Throws Error if it cannot.
PatchModel model_of_scene(const std::string& path, std::size_t patch_count);

/// Name of a scene's file, without folder and extension.
std::string scene_name(const std::filesystem::path& scene);
std::string scene_name(const TransferData& data);

}  // namespace rebounce::bench
