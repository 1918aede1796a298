// bench_report: the stored inverse against the iterative methods on chosen scenes, in full; one
// JSON file for each scene and number of patches. ./dev report makes a page of them.

#include <fmt/format.h>

#include <filesystem>

#include "bench/report/phase_seconds.h"
#include "bench/report/report.h"
#include "bench/support/input.h"
#include "bench/support/machine.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "precompute/cli/console.h"
#include "rebounce/error.h"

namespace rebounce::bench {
namespace {

struct Options {
  std::vector<std::string> scenes;
  std::vector<std::size_t> patch_counts = {1000, 4000};
  std::string folder = ".";
  bool quick = false, no_truth = false, no_pictures = false, describe = false;
  int solve_threads = ReportSettings{}.solve_threads;
  CommonOptions common{.repeats = 0};
};

ReportSettings settings_for(const Options& options, std::size_t patch_count) {
  ReportSettings settings;
  if (patch_count >= ReportSettings::kLarge) settings.make_large();
  if (patch_count >= ReportSettings::kHuge) settings.make_huge();
  if (options.quick) settings.make_quick();
  settings.patch_count = patch_count;
  settings.solve_threads = options.solve_threads;
  if (options.common.repeats > 0) settings.repeats = options.common.repeats;
  if (options.no_truth) settings.truth = false;
  if (options.no_pictures) settings.picture_width = 0;
  return settings;
}

nlohmann::ordered_json json_of(const ReportSettings& settings, bool quick) {
  return {{"quick", quick},
          {"seed", settings.seed},
          {"lamps", settings.lamp_count},
          {"solve_threads", settings.solve_threads},
          {"repeats", settings.repeats},
          {"frames", settings.frame_count},
          {"budgets_microseconds", settings.budgets},
          {"motions", settings.motions},
          {"tolerances", settings.tolerances},
          {"ranks", settings.ranks}};
}

/// Where figures come from.
nlohmann::ordered_json provenance(const CommonOptions& options) {
  const Machine machine = describe_machine();
  return {{"benchmark", "bench_report"},
          {"processor", machine.processor},
          {"processors", machine.processor_count},
          {"threads", thread_count(options)},
          {"compiler", machine.compiler},
          {"build_type", machine.build_type},
          {"commit", machine.commit}};
}

/// Measures one scene with one number of patches into files of their own.
void measure(const std::string& scene, std::size_t patch_count, const Options& options,
             cli::ProgressBar& bar) {
  const std::string name = fmt::format("{}-{}", scene_name(scene), patch_count);
  PhaseSeconds phases;
  const ReportProgress progress = [&](std::string_view phase, double part) {
    phases.enter(phase);
    return bar.update(fmt::format("{}: {}", name, phase), part);
  };
  const ReportSettings settings = settings_for(options, patch_count);
  nlohmann::ordered_json json = provenance(options.common);
  json["scene"] = scene_name(scene);
  json["settings"] = json_of(settings, options.quick);
  const double seconds = seconds_of(
      [&] { json.update(measure_scene(scene, settings, options.folder, name, progress)); });
  json["seconds"] = seconds;
  json["seconds_by_phase"] = phases.finish();
  write_text(std::filesystem::path(options.folder) / (name + ".json"), json.dump(1) + "\n");
}

void run(const Options& options) {
  if (options.describe) {
    fmt::print("{}\n", provenance(options.common).dump(2));
    return;
  }
  if (options.scenes.empty()) throw Error("there is nothing to measure; give a scene");
  cli::ProgressBar bar(true);
  std::filesystem::create_directories(options.folder);
  for (const std::string& scene : options.scenes) {
    for (const std::size_t patch_count : options.patch_counts) {
      measure(scene, patch_count, options, bar);
    }
  }
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("scenes", options.scenes, "Scenes: .glb or .gltf");
  add_patches_option(app, options.patch_counts);
  app.add_option("-o,--output", options.folder, "Folder for SCENE-PATCHES.json and pictures")
      ->capture_default_str();
  app.add_flag("--quick", options.quick, "A small part of everything");
  app.add_flag("--no-truth", options.no_truth, "Leave the path tracer out");
  app.add_flag("--no-pictures", options.no_pictures, "Draw nothing");
  app.add_flag("--describe", options.describe,
               "Print machine, compiler and commit as JSON, and do nothing");
  app.add_option("--solve-threads", options.solve_threads, "Threads while relighting is timed")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option(
         "--repeats", options.common.repeats,
         "Timings of each thing; 0: 7, 5 from 3,000 patches, 3 from 10,000 and with --quick")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  add_threads_option(app, options.common)
      ->description("Threads for all else; 0: one per processor");
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::cli::install_interrupt_handler();
  rebounce::bench::Options options;
  CLI::App app("The stored inverse against the iterative methods, in full.", "bench_report");
  rebounce::bench::add_options(app, options);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}
