#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "precompute/build/transfer_build.h"

namespace rebounce::bench {

/// What a benchmark runs on.
struct InputOptions {
  std::vector<std::string> inputs{};        ///< transfer files and scenes
  std::vector<std::size_t> patch_counts{};  ///< of scenes, in one run after the other
  BuildSettings settings{};                 ///< of scenes
  /// Scenes keep form factors as files store them: pairs, or fewer links than were found.
  bool with_form_factors = false;
  /// Only data with the form factors that their operator was made from: files without are refused,
  /// and links of scenes are found once more.
  bool with_truth = false;
};

/// Adds them; returns the option that takes the inputs, which is required.
CLI::Option* add_input_options(CLI::App& app, InputOptions& options);

/// Runs `work` with each transfer file, and with the data of each scene at each number of patches.
/// Throws Error if one cannot be used, or a scene has no number of patches.
void for_each_input(const InputOptions& options,
                    const std::function<void(std::shared_ptr<const TransferData>)>& work);

/// Throws Error if one of the inputs is a transfer file.
void require_scenes(const InputOptions& options);

/// Name of a scene's file, without folder and extension.
std::string scene_name(const std::filesystem::path& scene);
std::string scene_name(const TransferData& data);

}  // namespace rebounce::bench
