#pragma once

// The offline stage from end to end: scene file in, transfer data out.

#include <filesystem>

#include "precompute/build/build_report.h"
#include "precompute/build/build_settings.h"
#include "precompute/import/scene.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The scene of a file as the offline stage takes it: pieces that are plainly seen from behind are
/// double-sided (find_inside_out). Throws Error as import_gltf does.
Scene import_usable(const std::filesystem::path& path, double scale);

/// Runs the offline stage. Throws Error if the scene cannot be used or what it needs is over the
/// memory limit (before the expensive part), Cancelled if asked to stop.
TransferData build_transfer_data(const std::filesystem::path& scene_path,
                                 const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress = {},
                                 const EstimateListener& on_estimate = {});

}  // namespace rebounce
