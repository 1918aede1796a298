#pragma once

#include <CLI/CLI.hpp>

#include "precompute/cli/console.h"

namespace rebounce::cli {

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
