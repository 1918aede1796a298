#pragma once

// The offline stage from end to end: scene file in, transfer data out.

#include <filesystem>
#include <memory>

#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "rebounce/transfer_file.h"

namespace rebounce {

/// Runs the offline stage on a glTF scene (.glb or .gltf), and fills `report`. `progress` and
/// `on_estimate` may be empty. On all of OpenMP's threads; the same bits for any number of them.
/// save_transfer writes the result. Compare its record with the tolerance: a build that misses that
/// returns all the same. Throws Error if the scene or a setting cannot be used or what it needs is
/// over the memory limit (before form factors are begun, or once the links are known), Cancelled if
/// asked to stop.
std::shared_ptr<const TransferData> build_transfer(const std::filesystem::path& scene_path,
                                                   const BuildSettings& settings,
                                                   BuildReport& report,
                                                   const BuildProgress& progress = {},
                                                   const EstimateListener& on_estimate = {});

}  // namespace rebounce
