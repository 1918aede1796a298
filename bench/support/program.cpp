#include "bench/support/program.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <omp.h>

#include <ctime>
#include <exception>
#include <span>

#include "bench/support/machine.h"
#include "transfer/file/atomic_file.h"

namespace rebounce::bench {
namespace {

constexpr int kBadInput = 1, kUsage = 2;

/// Two lines: what was run when, and on what.
std::string provenance(const std::string& benchmark, const CommonOptions& options) {
  const Machine machine = describe_machine();
  const std::string repeats =
      options.repeats > 1 ? fmt::format("; {} repeats", options.repeats) : "";
  return fmt::format("{}, commit {}, {:%Y-%m-%d}\n{}, {} processors, {} threads; {}, {}{}\n",
                     benchmark, machine.commit, fmt::gmtime(std::time(nullptr)), machine.processor,
                     machine.processor_count, thread_count(options), machine.compiler,
                     machine.build_type, repeats);
}

std::string commented(std::string lines) {
  lines.insert(0, "# ");
  for (std::size_t at = 0; (at = lines.find('\n', at) + 1) < lines.size();) lines.insert(at, "# ");
  return lines;
}

}  // namespace

void add_common_options(CLI::App& app, CommonOptions& options) {
  app.add_option("--repeats", options.repeats, "Measurements of each thing")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  add_threads_option(app, options);
  add_csv_option(app, options);
}

CLI::Option* add_threads_option(CLI::App& app, CommonOptions& options) {
  return app.add_option("--threads", options.threads, "Threads to use; 0: one per processor")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}

void add_csv_option(CLI::App& app, CommonOptions& options) {
  app.add_option("--csv", options.csv, "Write the results to this file, as CSV");
}

void add_patches_option(CLI::App& app, std::vector<std::size_t>& patch_counts) {
  app.add_option("--patches", patch_counts, "Numbers of patches, separated by commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
}

void add_choice_option(CLI::App& app, const std::string& name, std::string& value,
                       const std::vector<std::string>& names, const std::string& description) {
  app.add_option(name, value, description)->check(CLI::IsMember(names))->capture_default_str();
}

int thread_count(const CommonOptions& options) {
  return options.threads > 0 ? options.threads : omp_get_num_procs();
}

int run_program(CLI::App& app, int argc, char** argv, const CommonOptions& options,
                const std::function<void()>& work) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  try {
    omp_set_num_threads(thread_count(options));
    work();
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), error.what());
    return kBadInput;
  }
}

void run_at_thread_counts(const CommonOptions& options, const std::function<void(int)>& work) {
  const int all = thread_count(options);
  omp_set_num_threads(1);
  work(1);
  omp_set_num_threads(all);
  if (all > 1) work(all);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}

void save(const std::string& benchmark, const Table& table, const CommonOptions& options) {
  if (options.csv.empty()) return;
  write_text(options.csv, commented(provenance(benchmark, options)) + table.csv());
}

void publish(const std::string& benchmark, const Table& table, const CommonOptions& options) {
  fmt::print("{}\n{}", provenance(benchmark, options), table.text());
  save(benchmark, table, options);
}

}  // namespace rebounce::bench
