#pragma once

// What the report says of one scene with one number of patches, as JSON:
// notes/reference/benchmarks.md tells the fields.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/report/contenders.h"

namespace rebounce::bench {

/// Measures everything that `settings` ask for; pictures go into `folder`, their files named after
/// `name`. Throws Error if the scene cannot be used, Cancelled if asked to stop.
nlohmann::ordered_json measure_scene(const std::string& scene, const ReportSettings& settings,
                                     const std::filesystem::path& folder, const std::string& name,
                                     const ReportProgress& progress);

}  // namespace rebounce::bench
