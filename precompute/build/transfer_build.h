#pragma once

// The offline stage from end to end: scene file in, transfer data out.

#include <filesystem>

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

}  // namespace rebounce
