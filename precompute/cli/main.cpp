#include <fmt/format.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>

#include "precompute/cli/commands.h"
#include "precompute/cli/console.h"
#include "precompute/cli/out_of_memory.h"
#include "rebounce/error.h"
#include "rebounce/version.h"

namespace {

constexpr int kBadInput = 1, kUsage = 2;

void add_common_options(CLI::App& command, rebounce::cli::CommonOptions& options) {
  command.add_flag(
      "--json", options.json,
      "Print a machine-readable summary on standard output, other text on standard error");
  command.add_flag("--quiet", options.quiet, "No progress and no summary");
  command
      .add_option("--threads", options.threads,
                  "Threads to use; 0: OMP_NUM_THREADS, or one per processor")
      ->check(CLI::Range(0, 4096))
      ->each([](const std::string& value) {
        // As CLI11 reads numbers: 0x4 and 010 have other bases.
        const int threads = std::stoi(value, nullptr, 0);
        if (threads > 0) omp_set_num_threads(threads);
      });
}

/// The error in the command line, in one line. CLI11 reports a missing command first and does not
/// name a word that it does not know.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining();
  const std::string what = app.get_subcommands().empty() && !unknown.empty()
                               ? fmt::format("unknown command \"{}\"", unknown.front())
                               : error.what();
  std::string command = "rebounce";
  for (const CLI::App* chosen : app.get_subcommands()) command += " " + chosen->get_name();
  return fmt::format("{}; see {} --help", what, command);
}

/// Takes no memory.
void say_out_of_memory() {
  std::fputs("rebounce: ", stderr);
  std::fputs(rebounce::cli::kOutOfMemory, stderr);
  std::fputs("\n", stderr);
}

int run(int argc, char** argv) {
  rebounce::cli::CommonOptions options;
  CLI::App app("Rebounce: all bounces of moving lights in a static scene, in one product.",
               "rebounce");
  app.set_version_flag("--version", std::string("rebounce ") + rebounce::version());
  app.require_subcommand(1);
  rebounce::cli::add_precompute_command(app, options);
  rebounce::cli::add_info_command(app, options);
  rebounce::cli::add_solve_command(app, options);
  rebounce::cli::add_export_command(app, options);
  rebounce::cli::add_render_command(app, options);
  rebounce::cli::add_bake_command(app, options);
  rebounce::cli::add_view_factors_command(app, options);
#ifdef REBOUNCE_WITH_VIEWER
  rebounce::cli::add_view_command(app, options);
#endif
  for (CLI::App* command : app.get_subcommands({})) add_common_options(*command, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "rebounce: {}\n", usage_message(app, error));
    return kUsage;
  }
  return 0;
}

const std::terminate_handler kUsualHandler = std::get_terminate();

/// For what nobody can catch, because it leaves a parallel region: memory that ran out there.
[[noreturn]] void report_and_exit() {
  try {
    if (const std::exception_ptr exception = std::current_exception()) {
      std::rethrow_exception(exception);
    }
  } catch (const std::bad_alloc&) {
    say_out_of_memory();
    std::_Exit(kBadInput);
  } catch (...) {
  }
  kUsualHandler();
  std::abort();
}

}  // namespace

int main(int argc, char** argv) {
  rebounce::cli::install_interrupt_handler();
  std::set_terminate(report_and_exit);
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    say_out_of_memory();
  } catch (const std::exception& error) {
    std::fputs(("rebounce: " + std::string(error.what()) + "\n").c_str(), stderr);
  }
  return kBadInput;
}
