#pragma once

#include <filesystem>
#include <string>

#include "precompute/build/transfer_build.h"

namespace rebounce::test {

/// For what needs any scene: few rays, and no rows of vertices.
inline BuildSettings quick_settings(std::size_t patch_count) {
  BuildSettings settings;
  settings.subdivision.patch_count = patch_count;
  settings.form_factors = with_quality(FormFactorQuality::kLow);
  settings.receiver_rows.at_vertices = false;
  return settings;
}

/// A scene of tests/scenes through the offline stage.
inline TransferData built_scene(const std::string& file, const BuildSettings& settings,
                                BuildReport& report) {
  return build_transfer_data(std::filesystem::path(REBOUNCE_SOURCE_DIR) / "tests" / "scenes" / file,
                             settings, report);
}
inline TransferData built_scene(const std::string& file, const BuildSettings& settings) {
  BuildReport report;
  return built_scene(file, settings, report);
}

}  // namespace rebounce::test
