// bench_truth: how far the indirect light of the whole pipeline is from the path tracer's, for a
// number of patches each.

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "bench/reference/compare_receivers.h"
#include "bench/reference/scene_key_light.h"
#include "bench/support/input.h"
#include "bench/support/program.h"
#include "bench/truth/error_causes.h"
#include "bench/truth/error_tables.h"
#include "bench/truth/pipeline_solution.h"
#include "precompute/build/transfer_build.h"
#include "precompute/cli/console.h"
#include "precompute/import/light_file.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/patches/winding.h"
#include "rebounce/error.h"
#include "runtime/frame/direct_lighting.h"

namespace rebounce {
namespace {

struct Options {
  std::string scene, lights, patch_csv, point_csv, error_picture;
  bool causes = false, receivers = false;
  std::string quality = "default";  ///< of the form factors
  std::vector<std::size_t> patch_counts{1000, 4000};
  bool key_light = false;
  std::string own_lights;  ///< file
  double lamp_weight = SubdivisionSettings{}.lamp_weight;
  ReceiverRowSettings rows{.at_vertices = false, .least_error = 0};
  std::size_t point_count = 20000;
  std::uint32_t samples = 512;
  int direct_points = DirectLightingSettings{}.points_per_patch;
  reference::PatchComparisonSettings patch_comparison;
  bench::CommonOptions common;
};

/// One row of the result.
struct Row {
  std::size_t patch_count = 0;
  reference::RelativeError patch_means, reconstruction, seen;
  reference::ReceiverErrors receivers;  ///< if they are asked for
};

/// The scene, its light, and the path tracer's truth at points of it: the same for every number of
/// patches.
class TruthBench {
 public:
  TruthBench(const Options& options, cli::ProgressBar& bar)
      : options_(options),
        bar_(bar),
        scene_(import_usable(options.scene, 1)),
        tracer_(reference::make_scene_tracer(scene_)),
        sides_(find_lit_sides(scene_, tracer_)) {
    choose_lights();
    if (!options.own_lights.empty()) own_lights_ = read_lights(options.own_lights).lights;
    points_ = reference::sample_surface(scene_, sides_, options.point_count,
                                        options.patch_comparison.seed);
    truth_ =
        reference::indirect_irradiance(lit_scene(), points_, options.samples,
                                       options.patch_comparison.seed, progress("truth at points"));
  }

  Row run(std::size_t patch_count, bool last) {
    const reference::Solution solution = solve(patch_count);
    const bool draws = last && !options_.error_picture.empty();
    const bool finds_causes = last && options_.causes;
    reference::PatchComparisonSettings settings = options_.patch_comparison;
    if (draws || finds_causes) settings.patch_count = 0;  // all of them are needed
    const reference::PatchComparison patches =
        reference::compare_patch_means(solution.data, solution.indirect_irradiance, lit_scene(),
                                       settings, progress("truth on patches"));
    if (draws) reference::draw_error(solution, patches, options_.error_picture);
    if (last && !options_.patch_csv.empty()) {
      const reference::OneBounce bounce =
          finds_causes ? reference::find_one_bounce(solution, patches, setup_.lights, setup_.sky,
                                                    settings.seed)
                       : reference::OneBounce{};
      reference::write_patch_table(options_.patch_csv, solution.data.patches, patches,
                                   solution.indirect_irradiance, bounce);
    }
    const reference::ReconstructionComparison shown = reference::compare_reconstruction(
        solution.data, solution.tracer, solution.indirect_irradiance, points_, truth_,
        solution.radiosity);
    if (last && !options_.point_csv.empty()) {
      reference::write_point_table(options_.point_csv, solution.data, points_, truth_, shown);
    }
    Row row{solution.data.patches.size(), patches.relative, shown.relative, shown.seen, {}};
    if (options_.receivers) {
      row.receivers = reference::compare_receivers(
          {solution.data, solution.tracer, solution.indirect_irradiance, setup_.lights, setup_.sky},
          shown, points_, truth_, settings.seed);
    }
    return row;
  }

 private:
  reference::LitScene lit_scene() const { return {scene_, tracer_, setup_.lights, setup_.sky}; }

  Progress progress(const char* phase) {
    return [this, phase](double fraction) { return bar_.update(phase, fraction); };
  }

  void choose_lights() {
    if (!options_.lights.empty()) {
      setup_ = read_lights(options_.lights);
    } else if (options_.key_light) {
      setup_.lights = {reference::make_key_light(scene_, tracer_, sides_)};
      print_as_file(setup_.lights.front());
    } else {
      setup_.lights = scene_.lights;
    }
    const bool emits = std::ranges::any_of(scene_.materials, [](const Material& m) {
      return m.emitted_luminance != Float3{0, 0, 0};
    });
    if (setup_.lights.empty() && setup_.sky.luminance == 0 && !emits) {
      throw Error(options_.scene + " has no light of its own; give --lights or --key-light");
    }
  }

  /// What --lights takes: the key light moves when other sides count as lit.
  static void print_as_file(const Light& lamp) {
    const auto& [x, y, z] = lamp.position;
    fmt::print(R"({{"lights":[{{"type":"point","position":[{},{},{}],"intensity":{}}}]}})"
               "\n",
               x, y, z, lamp.intensity);
  }

  reference::Solution solve(std::size_t patch_count) {
    const reference::PipelineSettings settings{.patch_count = patch_count,
                                               .quality = quality_named(options_.quality),
                                               .direct_points = options_.direct_points,
                                               .receiver_rows = options_.rows,
                                               .own_lights = own_lights_,
                                               .lamp_weight = options_.lamp_weight};
    return reference::solve_scene(
        options_.scene, settings, setup_.lights, setup_.sky,
        [this](std::string_view phase, double part) { return bar_.update(phase, part); });
  }

  const Options& options_;
  cli::ProgressBar& bar_;
  Scene scene_;
  RayTracer tracer_;
  std::vector<TriangleSides> sides_;
  LightSetup setup_;
  std::optional<std::vector<Light>> own_lights_;
  std::vector<reference::SurfacePoint> points_;
  reference::IrradianceEstimate truth_;
};

void run(const Options& options) {
  std::vector<std::string> columns{"scene",
                                   "patches",
                                   "patch_mean_error",
                                   "patch_mean_noise",
                                   "patches_compared",
                                   "reconstruction_error",
                                   "reconstruction_noise",
                                   "points_compared",
                                   "points_left_out",
                                   "seen_error",
                                   "points_seen"};
  if (options.receivers) {
    columns.insert(columns.end(), {"patch_value_error", "row_error", "smooth_light_error",
                                   "exact_lamp_error", "exact_both_error"});
  }
  bench::Table table(std::move(columns));
  {
    cli::ProgressBar bar(true);
    TruthBench bench(options, bar);
    for (const std::size_t patch_count : options.patch_counts) {
      const Row row = bench.run(patch_count, patch_count == options.patch_counts.back());
      const reference::RelativeError &means = row.patch_means, &shown = row.reconstruction;
      std::vector<bench::Table::Cell> cells{bench::scene_name(options.scene),
                                            row.patch_count,
                                            means.error,
                                            means.noise,
                                            means.count,
                                            shown.error,
                                            shown.noise,
                                            shown.count,
                                            shown.left_out_count,
                                            row.seen.error,
                                            row.seen.count};
      if (options.receivers) {
        const reference::ReceiverErrors& of = row.receivers;
        for (const auto& e :
             {of.patch_value, of.rows, of.smooth_light, of.exact_lamps, of.exact_both}) {
          cells.push_back(e.error);
        }
      }
      table.add(std::move(cells));
      bench::save("bench_truth", table, options.common);
    }
  }
  bench::publish("bench_truth", table, options.common);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene, "Scene: .glb or .gltf")->required();
  bench::add_patches_option(app, options.patch_counts);
  auto* lights = app.add_option("--lights", options.lights,
                                "Lights: .json, or a .glb that has some; by default the scene's");
  app.add_flag("--key-light", options.key_light, "One point light at a place found for it")
      ->excludes(lights);
  app.add_option("--own-lights", options.own_lights,
                 "Lamps that the build takes for the scene's own; by default those of the asset");
  app.add_option("--lamp-weight", options.lamp_weight,
                 "How much finer patches are where the light of the scene's own lamps varies")
      ->capture_default_str();
  app.add_option("--points", options.point_count, "Points at which the reconstruction is compared")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  app.add_option("--samples", options.samples, "Paths from each of these points")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  reference::PatchComparisonSettings& patches = options.patch_comparison;
  app.add_option("--compared-patches", patches.patch_count, "Patches compared; 0: all of them")
      ->capture_default_str();
  app.add_option("--patch-points", patches.points_per_patch, "Points on each of these patches")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--patch-samples", patches.samples_per_point, "Paths from each of these points")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--direct-points", options.direct_points,
                 "Points of a patch at which the pipeline looks at lamps")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  std::vector<std::string> qualities;
  for (const NamedQuality& q : kQualities) qualities.emplace_back(q.name);
  bench::add_choice_option(app, "--form-factor-quality", options.quality, qualities,
                           "Quality of the form factors");
  app.add_option("--seed", patches.seed, "Of all that is random")->capture_default_str();
  bench::add_csv_option(app, options.common);
  auto* patch_csv =
      app.add_option("--patch-csv", options.patch_csv,
                     "Table to write of the compared patches, for the last number of patches");
  app.add_flag("--causes", options.causes,
               "Compare all patches and add to their table what one bounce of the truth's light "
               "brings them, along rays and by the form factors")
      ->needs(patch_csv);
  app.add_flag("--receivers", options.receivers,
               "Add the errors that points would have with rows of their own, and with light of "
               "patches that varies on them");
  app.add_flag("--rows-at-vertices", options.rows.at_vertices, "Give vertices rows of their own");
  app.add_option("--receiver-rays", options.rows.ray_count, "Rays of each of these vertices")
      ->capture_default_str();
  app.add_option("--receiver-sets", options.rows.most_sets,
                 "Sets that a group of them sees at most")
      ->capture_default_str();
  app.add_option("--receiver-tolerance", options.rows.tolerance, "Error at which rows end")
      ->capture_default_str();
  app.add_option("--point-csv", options.point_csv,
                 "Table to write of the compared points, for the last number of patches");
  app.add_option("--error-picture", options.error_picture,
                 "Picture (.png) of where the patch means err, for the last number of patches");
  bench::add_threads_option(app, options.common);
}

}  // namespace
}  // namespace rebounce

int main(int argc, char** argv) {
  rebounce::cli::install_interrupt_handler();
  rebounce::Options options;
  CLI::App app("The pipeline's indirect light against a path tracer's.", "bench_truth");
  rebounce::add_options(app, options);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::run(options); });
}
