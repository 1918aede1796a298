// bench_truth: how far the indirect light of the whole pipeline is from the path tracer's, for a
// number of patches each.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "bench/named_quality.h"
#include "bench/program.h"
#include "bench/reference/compare.h"
#include "bench/reference/key_light.h"
#include "bench/truth/error_causes.h"
#include "bench/truth/error_tables.h"
#include "precompute/base/csv_writer.h"
#include "precompute/build/build.h"
#include "precompute/cli/console.h"
#include "precompute/cli/light_file.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/patches/winding.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/error.h"
#include "transfer/base/reflection.h"

namespace rebounce {
namespace {

struct Options {
  std::string scene, lights, csv, patch_csv, point_csv, error_picture;
  bool causes = false;
  std::string quality = "default";  ///< of the form factors
  std::vector<std::size_t> patch_counts{1000, 4000};
  bool key_light = false;
  std::size_t point_count = 20000;
  std::uint32_t samples = 512;
  int direct_points = DirectLightingSettings{}.points_per_patch;
  reference::PatchComparisonSettings patch_comparison;
  bench::CommonOptions common;
};

FormFactorQuality quality_named(const std::string& name) {
  return std::ranges::find(bench::kQualities, name, &bench::NamedQuality::name)->quality;
}

/// One row of the result.
struct Row {
  std::size_t patch_count = 0;
  reference::RelativeError patch_means, reconstruction;
};

/// One number of patches: its form factors, and their light.
struct Solution {
  TransferData data;
  RayTracer tracer;  ///< the surface of data.mesh
  std::vector<Float3> indirect_irradiance;
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
    points_ = reference::sample_surface(scene_, sides_, options.point_count,
                                        options.patch_comparison.seed);
    truth_ =
        reference::indirect_irradiance(lit_scene(), points_, options.samples,
                                       options.patch_comparison.seed, progress("truth at points"));
  }

  Row run(std::size_t patch_count, bool last) {
    const Solution solution = solve(patch_count);
    const bool draws = last && !options_.error_picture.empty();
    const bool finds_causes = last && options_.causes;
    reference::PatchComparisonSettings settings = options_.patch_comparison;
    if (draws || finds_causes) settings.patch_count = 0;  // all of them are needed
    const reference::PatchComparison patches =
        reference::compare_patch_means(solution.data, solution.indirect_irradiance, lit_scene(),
                                       settings, progress("truth on patches"));
    if (draws) draw_error(solution, patches, options_.error_picture);
    if (last && !options_.patch_csv.empty()) {
      const reference::OneBounce bounce =
          finds_causes ? one_bounce(solution, patches) : reference::OneBounce{};
      reference::write_patch_table(options_.patch_csv, solution.data.patches, patches,
                                   solution.indirect_irradiance, bounce);
    }
    const reference::ReconstructionComparison shown = reference::compare_reconstruction(
        solution.data, solution.tracer, solution.indirect_irradiance, points_, truth_);
    if (last && !options_.point_csv.empty()) {
      reference::write_point_table(options_.point_csv, solution.data, points_, truth_, shown);
    }
    return {solution.data.patches.size(), patches.relative, shown.relative};
  }

 private:
  reference::LitScene lit_scene() const { return {scene_, tracer_, setup_.lights, setup_.sky}; }

  Progress progress(const char* phase) {
    return [this, phase](double fraction) { return bar_.update(phase, fraction); };
  }

  void choose_lights() {
    if (!options_.lights.empty()) {
      setup_ = cli::read_lights(options_.lights);
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

  /// Solves with the form factors themselves: an operator adds its own error, and many patches
  /// take long to invert.
  Solution solve(std::size_t patch_count) {
    BuildSettings settings;
    settings.subdivision.patch_count = patch_count;
    settings.operator_kind = OperatorKind::kNoOperator;
    settings.store_form_factors = true;
    settings.form_factors = with_quality(quality_named(options_.quality), settings.form_factors);
    BuildReport report;
    TransferData data = build_transfer_data(
        options_.scene, settings, report,
        [this](std::string_view phase, double part) { return bar_.update(phase, part); });
    RayTracer tracer = make_surface_tracer(data.mesh);
    std::vector<Float3> indirect = indirect_irradiance(data, tracer);
    return {std::move(data), std::move(tracer), std::move(indirect)};
  }

  std::vector<Float3> indirect_irradiance(const TransferData& data, const RayTracer& tracer) const {
    const PatchTable& patches = data.patches;
    std::vector<Float3> exitance(patches.size()), radiosity(patches.size());
    DirectLighting(data, tracer, {.points_per_patch = options_.direct_points})
        .compute(setup_.lights, setup_.sky, exitance);
    add_reflected(patches.emitted_exitance, patches.reflectance, exitance, exitance);
    const auto form_factors = make_form_factors(kMethod, data.exchange, patches.area);
    const SolveResult result = solve_radiosity(
        kMethod, *form_factors, {patches.area, patches.reflectance}, exitance, {}, radiosity);
    if (!result.converged) throw Error(options_.scene + ": the solver did not converge");
    return gather(*form_factors, radiosity);
  }

  /// |H - truth| of each patch, as a part of the truth's root mean square.
  static std::vector<float> patch_errors(const Solution& solution,
                                         const reference::PatchComparison& patches) {
    const TransferData& data = solution.data;
    double area = 0;
    std::vector<Float3> truth(data.patches.size(), Float3{0, 0, 0});
    for (std::size_t k = 0; k < patches.patch.size(); ++k) {
      truth[patches.patch[k]] = patches.truth[k];
    }
    for (const float a : data.patches.area) area += a;
    const double rms = area_norm(truth, data.patches.area) / std::sqrt(area);
    std::vector<float> error(data.patches.size(), 0.0F);
    for (const std::uint32_t i : patches.patch) {
      const Float3& value = solution.indirect_irradiance[i];
      const double difference =
          std::hypot(value[0] - truth[i][0], value[1] - truth[i][1], value[2] - truth[i][2]);
      if (rms > 0) error[i] = static_cast<float>(difference / rms);
    }
    return error;
  }

  static void draw_error(const Solution& solution, const reference::PatchComparison& patches,
                         const std::string& path) {
    const TransferData& data = solution.data;
    const std::vector<float> error = patch_errors(solution, patches);
    PictureSettings settings;
    settings.show = Show::kError;
    settings.camera =
        data.cameras.empty() ? fit_camera(data, solution.tracer) : data.cameras.front();
    PictureLight light;
    light.error = error;
    write_png(path, tone_map(render_picture(data, solution.tracer, light, settings)));
  }

  /// What one bounce brings of the truth's light.
  reference::OneBounce one_bounce(const Solution& solution,
                                  const reference::PatchComparison& patches) const {
    const PatchTable& table = solution.data.patches;
    std::vector<Float3> irradiance(table.size()), radiosity(table.size());
    DirectLighting(solution.data, solution.tracer, {.points_per_patch = kManyPoints})
        .compute(setup_.lights, setup_.sky, irradiance);
    for (std::size_t k = 0; k < patches.patch.size(); ++k) {
      for (int c = 0; c < 3; ++c) irradiance[patches.patch[k]][c] += patches.truth[k][c];
    }
    add_reflected(table.emitted_exitance, table.reflectance, irradiance, radiosity);
    return reference::find_one_bounce(solution.data, solution.tracer, radiosity, kBounceRays,
                                      options_.patch_comparison.seed);
  }

  // Points of a patch and rays from it, of which the noise is far below what is looked for.
  static constexpr int kManyPoints = 256, kBounceRays = 16384;

  static constexpr SolveMethod kMethod = SolveMethod::kConjugateGradient;

  const Options& options_;
  cli::ProgressBar& bar_;
  Scene scene_;
  RayTracer tracer_;
  std::vector<TriangleSides> sides_;
  cli::LightSetup setup_;
  std::vector<reference::SurfacePoint> points_;
  reference::IrradianceEstimate truth_;
};

void print_row(const Row& row) {
  const auto percent = [](double part) { return fmt::format("{:.2f} %", 100 * part); };
  fmt::print("{:>8}  {:>9} {:>9} {:>7}  {:>9} {:>9} {:>7} {:>9}\n", row.patch_count,
             percent(row.patch_means.error), percent(row.patch_means.noise), row.patch_means.count,
             percent(row.reconstruction.error), percent(row.reconstruction.noise),
             row.reconstruction.count, row.reconstruction.left_out_count);
}

void write_rows(const std::string& path, const std::vector<Row>& rows) {
  std::vector<float> values;
  for (const Row& row : rows) {
    for (const double value :
         {static_cast<double>(row.patch_count), row.patch_means.error, row.patch_means.noise,
          static_cast<double>(row.patch_means.count), row.reconstruction.error,
          row.reconstruction.noise, static_cast<double>(row.reconstruction.count),
          static_cast<double>(row.reconstruction.left_out_count)}) {
      values.push_back(static_cast<float>(value));
    }
  }
  const CsvColumns columns{
      {"patches", "patch_mean_error", "patch_mean_noise", "patches_compared",
       "reconstruction_error", "reconstruction_noise", "points_compared", "points_left_out"},
      values};
  write_csv(path, {&columns, 1});
}

void run(const Options& options) {
  std::vector<Row> rows;
  {
    cli::ProgressBar bar(true);
    TruthBench bench(options, bar);
    fmt::print("{:>8}  {:^27}  {:^37}\n", "", "patch means", "smooth reconstruction");
    fmt::print("{:>8}  {:>9} {:>9} {:>7}  {:>9} {:>9} {:>7} {:>9}\n", "patches", "error", "noise",
               "count", "error", "noise", "count", "left out");
    for (const std::size_t patch_count : options.patch_counts) {
      const bool last = patch_count == options.patch_counts.back();
      rows.push_back(bench.run(patch_count, last));
      print_row(rows.back());
      std::fflush(stdout);
    }
  }
  if (!options.csv.empty()) write_rows(options.csv, rows);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("scene", options.scene, "Scene: .glb or .gltf")->required();
  bench::add_patches_option(app, options.patch_counts);
  auto* lights = app.add_option("--lights", options.lights,
                                "Lights: .json, or a .glb that has some; by default the scene's");
  app.add_flag("--key-light", options.key_light, "One point light at a place found for it")
      ->excludes(lights);
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
  for (const bench::NamedQuality& q : bench::kQualities) qualities.emplace_back(q.name);
  app.add_option("--form-factor-quality", options.quality, "Quality of the form factors")
      ->check(CLI::IsMember(qualities))
      ->capture_default_str();
  app.add_option("--seed", patches.seed, "Of all that is random")->capture_default_str();
  app.add_option("--csv", options.csv, "Table to write");
  app.add_option("--patch-csv", options.patch_csv,
                 "Table to write of the compared patches, for the last number of patches");
  app.add_flag("--causes", options.causes,
               "Compare all patches and add to their table what one bounce of the truth's light "
               "brings them, along rays and by the form factors");
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
