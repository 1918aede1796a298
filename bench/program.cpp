#include "bench/program.h"

#include <fmt/format.h>
#include <omp.h>

#include <exception>

#include "bench/machine.h"
#include "transfer/file/atomic_file.h"

namespace rebounce::bench {
namespace {

constexpr int kBadInput = 1, kUsage = 2;

const CLI::Range kPatches(1, 1000000);

}  // namespace

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}

nlohmann::ordered_json provenance(const std::string& benchmark, const CommonOptions& options) {
  const Machine machine = describe_machine();
  return {{"benchmark", benchmark},
          {"processor", machine.processor},
          {"processors", machine.processor_count},
          {"threads", thread_count(options)},
          {"compiler", machine.compiler},
          {"build_type", machine.build_type},
          {"commit", machine.commit},
          {"repeats", options.repeats}};
}

void add_common_options(CLI::App& app, CommonOptions& options) {
  app.add_option("--repeats", options.repeats, "Measurements of each thing")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  add_threads_option(app, options);
  app.add_option("--json", options.json, "Write the results to this file, as JSON");
  app.add_option("--csv", options.csv, "Write the results to this file, as CSV");
}

CLI::Option* add_threads_option(CLI::App& app, CommonOptions& options) {
  return app.add_option("--threads", options.threads, "Threads to use; 0: one per processor")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
}

int thread_count(const CommonOptions& options) {
  return options.threads > 0 ? options.threads : omp_get_num_procs();
}

void add_scene_option(CLI::App& app, std::vector<std::string>& scenes) {
  app.add_option("scenes", scenes, "Scenes (.glb or .gltf)")->required();
}

void add_input_option(CLI::App& app, std::vector<std::string>& inputs) {
  app.add_option("inputs", inputs, "Transfer files, or scenes to build them from")->required();
}

void add_patch_option(CLI::App& app, std::size_t& patch_count) {
  app.add_option("--patches", patch_count, "Patches of each scene, about")
      ->check(kPatches)
      ->capture_default_str();
}

void add_patches_option(CLI::App& app, std::vector<std::size_t>& patch_counts) {
  app.add_option("--patches", patch_counts, "Numbers of patches, separated by commas")
      ->delimiter(',')
      ->check(kPatches)
      ->capture_default_str();
}

void run_at_thread_counts(const CommonOptions& options, const std::function<void(int)>& work) {
  const int all = thread_count(options);
  work(1);
  if (all > 1) work(all);
  omp_set_num_threads(all);
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

void publish(const std::string& benchmark, const Table& table, const CommonOptions& options) {
  const Machine machine = describe_machine();
  const int threads = thread_count(options);
  fmt::print("{}: {}, {} processors, {} threads; {}, {}; commit {}; medians of {}\n\n{}", benchmark,
             machine.processor, machine.processor_count, threads, machine.compiler,
             machine.build_type, machine.commit, options.repeats, table.text());
  if (!options.csv.empty()) write_text(options.csv, table.csv());
  if (options.json.empty()) return;
  nlohmann::ordered_json json = provenance(benchmark, options);
  json["rows"] = table.json();
  write_text(options.json, json.dump(2) + "\n");
}

}  // namespace rebounce::bench
