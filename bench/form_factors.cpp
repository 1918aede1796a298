// How exact form factors are: against closed forms and against a hundred times the rays; how fast
// beside bare Embree; and how what they take grows with the number of patches.

#include "bench/closed_forms.h"
#include "bench/form_factor_scaling.h"
#include "bench/program.h"
#include "bench/scene_form_factors.h"
#include "precompute/exchange/links/links.h"

namespace rebounce::bench {
namespace {

struct Options {
  std::vector<std::string> scenes;
  std::string table = REBOUNCE_SOURCE_DIR "/tests/reference/view_factors.tsv";
  std::size_t patch_count = 1000;
  int reference_factor = 100;
  double ray_limit = 2e6;
  std::vector<std::size_t> scaling_patches = {4000, 16000, 64000};
  double link_epsilon = kLinkEpsilon;
  std::string part = "all";
  CommonOptions common{.repeats = 5};
};

void run(const Options& options) {
  AskedTable report;
  const bool all = options.part == "all";
  if (all || options.part == "closed-forms") measure_closed_forms(options.table, report);
  for (const std::string& scene : options.scenes) {
    if (options.part == "growth-of-links") {
      measure_growth(scene, options.scaling_patches, options.link_epsilon, report);
      continue;
    }
    SceneFormFactors bench(scene, options.patch_count, report);
    if (all || options.part == "convergence") bench.measure_convergence(options.reference_factor);
    if (all || options.part == "speed") {
      bench.measure_speed(options.ray_limit, options.common.repeats);
    }
  }
  publish("form_factors", report.table(), options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  Options options;
  CLI::App app("How exact form factors are, and how fast beside bare Embree", "bench_form_factors");
  app.add_option("scenes", options.scenes,
                 "Scenes (.glb or .gltf), against a reference with many rays");
  app.add_option("--patches", options.patch_count, "Patches of a scene")
      ->check(CLI::Range(1, 4000))
      ->capture_default_str();
  app.add_option("--reference", options.reference_factor,
                 "How many times the default rays the reference has")
      ->check(CLI::Range(4, 10000))
      ->capture_default_str();
  app.add_option("--table", options.table, "Table of view factors")->capture_default_str();
  app.add_option("--ray-limit", options.ray_limit, "Rays that lie ready for bare Embree at most")
      ->check(CLI::Range(1e3, 1e9))
      ->capture_default_str();
  app.add_option("--growth-patches", options.scaling_patches, "Patches of growth-of-links")
      ->capture_default_str();
  app.add_option("--link-epsilon", options.link_epsilon, "Error of a link, likewise")
      ->capture_default_str();
  app.add_option("--part", options.part,
                 "What to measure; all but closed-forms for each scene; all: without growth")
      ->check(CLI::IsMember({"all", "closed-forms", "convergence", "speed", "growth-of-links"}))
      ->capture_default_str();
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}
