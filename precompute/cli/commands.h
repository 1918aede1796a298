#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "precompute/cli/console.h"

namespace rebounce::cli {

/// What an option may be: the names in a table whose entries have one each.
std::vector<std::string> option_names(const auto& table) {
  std::vector<std::string> names;
  for (const auto& entry : table) names.emplace_back(entry.name);
  return names;
}

// Each function adds its sub-command to `app`. The command runs when the command line is parsed.
// `options` must outlive `app`.
void add_precompute_command(CLI::App& app, const CommonOptions& options);
void add_info_command(CLI::App& app, const CommonOptions& options);
void add_solve_command(CLI::App& app, const CommonOptions& options);
void add_export_command(CLI::App& app, const CommonOptions& options);
void add_render_command(CLI::App& app, const CommonOptions& options);
void add_bake_command(CLI::App& app, const CommonOptions& options);
void add_view_factors_command(CLI::App& app, const CommonOptions& options);
// Only in builds with the viewer.
void add_view_command(CLI::App& app, const CommonOptions& options);

}  // namespace rebounce::cli
