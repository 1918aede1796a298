#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/support/table.h"

namespace rebounce::bench {

/// Options that every benchmark has.
struct CommonOptions {
  int repeats = 0;    ///< measurements of each thing
  int threads = 0;    ///< OpenMP threads; 0: one per processor
  std::string csv{};  ///< file to write the results to; empty: none
};

/// Adds them; the default of `repeats` is what `options` holds.
void add_common_options(CLI::App& app, CommonOptions& options);

/// Adds some of them.
CLI::Option* add_threads_option(CLI::App& app, CommonOptions& options);
void add_csv_option(CLI::App& app, CommonOptions& options);

/// Adds about how many patches a scene is to have in one run after the other.
void add_patches_option(CLI::App& app, std::vector<std::size_t>& patch_counts);

/// Adds an option whose value is one of `names`; the default is what `value` holds.
void add_choice_option(CLI::App& app, const std::string& name, std::string& value,
                       const std::vector<std::string>& names, const std::string& description);

/// Number of threads that `options` asks for.
int thread_count(const CommonOptions& options);

/// Parses the command line, runs `work` with that many OpenMP threads, and returns the status to
/// exit with: 0, or after a line on standard error 1 (bad input) or 2 (usage).
int run_program(CLI::App& app, int argc, char** argv, const CommonOptions& options,
                const std::function<void()>& work);

/// Runs `work`(threads) with one OpenMP thread and with as many as `options` asks for.
void run_at_thread_counts(const CommonOptions& options, const std::function<void(int)>& work);

/// Writes a file whole or not at all. Throws Error if it cannot.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Writes the file that `options` names, if they name one: lines that begin with # and say where
/// the figures come from, then the table as CSV.
void save(const std::string& benchmark, const Table& table, const CommonOptions& options);

/// The same, and prints both.
void publish(const std::string& benchmark, const Table& table, const CommonOptions& options);

}  // namespace rebounce::bench
