#pragma once

// The offline stage from end to end: scene file in, transfer data out.

#include <filesystem>

#include "precompute/import/scene.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Runs the offline stage. Throws Error if the scene cannot be used or what it needs is over the
/// memory limit (before the expensive part), Cancelled if asked to stop.
TransferData build_transfer_data(const std::filesystem::path& scene_path,
                                 const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress = {},
                                 const EstimateListener& on_estimate = {});

/// The same on a scene that the caller has made, whose indices and sizes are in order. Its fronts
/// are taken as they are.
TransferData build_transfer_data(Scene scene, const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress = {},
                                 const EstimateListener& on_estimate = {});

}  // namespace rebounce
