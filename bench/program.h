#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/table.h"

namespace rebounce::bench {

/// Options that every benchmark has.
struct CommonOptions {
  int repeats = 0;            ///< measurements of each thing
  int threads = 0;            ///< OpenMP threads; 0: one per processor
  std::string json{}, csv{};  ///< files to write the results to; empty: none
};

/// Adds them; the default of `repeats` is what `options` holds.
void add_common_options(CLI::App& app, CommonOptions& options);

/// Adds the number of threads alone.
CLI::Option* add_threads_option(CLI::App& app, CommonOptions& options);

/// Number of threads that `options` asks for.
int thread_count(const CommonOptions& options);

/// Parses the command line, runs `work` with that many OpenMP threads, and returns the status to
/// exit with: 0, or after a line on standard error 1 (bad input) or 2 (usage).
int run_program(CLI::App& app, int argc, char** argv, const CommonOptions& options,
                const std::function<void()>& work);

/// Adds the scenes that a benchmark is to run on.
void add_scene_option(CLI::App& app, std::vector<std::string>& scenes);

/// Adds the transfer files or scenes that a benchmark is to run on.
void add_input_option(CLI::App& app, std::vector<std::string>& inputs);

/// Adds about how many patches a scene is to have.
void add_patch_option(CLI::App& app, std::size_t& patch_count);

/// Adds about how many patches a scene is to have in one run after the other.
void add_patches_option(CLI::App& app, std::vector<std::size_t>& patch_counts);

/// Runs `work`(threads) with one thread and with as many as `options` asks for, and leaves OpenMP
/// with those.
void run_at_thread_counts(const CommonOptions& options, const std::function<void(int)>& work);

/// Where figures come from: machine, threads, compiler, commit, repeats.
nlohmann::ordered_json provenance(const std::string& benchmark, const CommonOptions& options);

/// Writes a file whole or not at all. Throws Error if it cannot.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Prints where the figures come from and the table, and writes the files that `options` names.
void publish(const std::string& benchmark, const Table& table, const CommonOptions& options);

}  // namespace rebounce::bench
