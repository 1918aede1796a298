// The offline stage by phase, beside what bare Embree and BLAS reach in the same run.

#include <algorithm>
#include <map>
#include <optional>

#include "bench/blas_peak.h"
#include "bench/input.h"
#include "bench/program.h"
#include "bench/stage_speed.h"
#include "bench/timing.h"
#include "precompute/build/build.h"
#include "precompute/inverse/tiled_cholesky.h"
#include "transfer/base/error.h"

namespace rebounce::bench {
namespace {

struct OfflineOptions {
  std::vector<std::string> scenes;
  BuildSettings settings;
  double ray_limit = 4e6;
  CommonOptions common{.repeats = 5};
};

/// A symmetric positive definite matrix of n x n; what its entries are makes no difference to how
/// long the inversion takes.
TiledMatrix<double> test_matrix(std::size_t n) {
  TiledMatrix<double> matrix(n);
  const double off_diagonal = -0.5 / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i / matrix.kTile < j / matrix.kTile) break;
      matrix.at(i, j) = i == j ? 1.0 : off_diagonal;
    }
  }
  return matrix;
}

/// Measures one scene: the whole stage, and its parts by themselves.
class OfflineStage {
 public:
  OfflineStage(const std::string& scene, const OfflineOptions& options)
      : scene_(scene),
        options_(options),
        model_(model_of_scene(scene, options.settings.subdivision.patch_count)),
        tracer_(make_surface_tracer(model_.mesh)),
        matrix_(test_matrix(model_.patches.size())) {}

  void measure() {
    build_transfer_data(scene_, options_.settings, report_);
    speed_.emplace(model_, tracer_, ff_settings(), options_.ray_limit, report_.ray_count);
    BlasPeak blas;
    blas_flops_ = blas.flops();
    for (int repeat = 0; repeat < options_.common.repeats; ++repeat) {
      measure_stage();
      speed_->measure_once();
      TiledMatrix<double> matrix = matrix_;
      add("inverse", [&] { invert_positive_definite(matrix); });
      add("dgemm", [&] { blas.run(); });
    }
  }

  void report(Table& table) const {
    for (const auto& [phase, seconds] : report_.seconds) {
      if (phase == "form factors") {
        report_form_factors(table);
      } else {
        row(table, phase, timing(phase));
      }
    }
    report_algebra(table);
  }

 private:
  const FormFactorSettings& ff_settings() const { return options_.settings.form_factors; }

  void add(const std::string& what, const std::function<void()>& work) {
    samples_[what].push_back(seconds_of(work));
  }

  void measure_stage() {
    report_ = {};
    build_transfer_data(scene_, options_.settings, report_);
    for (const auto& [phase, seconds] : report_.seconds) samples_[phase].push_back(seconds);
  }

  Timing timing(const std::string& what) const { return summarise(samples_.at(what)); }

  void row(Table& table, const std::string& what, const Timing& time, const Table::Cell& rate = {},
           const Table::Cell& unit = {}, const Table::Cell& ratio = {},
           const Table::Cell& baseline = {}) const {
    table.add({scene_name(scene_), model_.patches.size(), what, time.median, time.spread, rate,
               unit, ratio, baseline});
  }

  void report_form_factors(Table& table) const {
    const Timing phase = timing("form factors");
    const auto rays = static_cast<double>(report_.ray_count);
    const double escape =
        static_cast<double>(model_.patches.size()) * ff_settings().hemisphere_rays;
    const double bare = speed_->bare_seconds(rays - escape, escape, &Timing::median);
    row(table, "form factors", phase, rays / phase.median / 1e6, "Mray/s", bare / phase.median,
        "bare Embree, same rays");
    const Timing pairs = speed_->pairs();
    const double all_pairs =
        speed_->kernel_seconds(static_cast<double>(report_.pair_count), &Timing::median);
    row(table, "pairs and kernel alone", {all_pairs, pairs.spread, 0},
        static_cast<double>(speed_->pair_count()) / pairs.median / 1e6, "Mpair/s",
        all_pairs / phase.median, "form factors");
    report_embree(table, "shadow", static_cast<double>(speed_->shadow_count()));
    report_embree(table, "escape", static_cast<double>(speed_->escape_count()));
  }

  void report_embree(Table& table, const std::string& kind, double ray_count) const {
    for (const TraceMode mode : kTraceModes) {
      const Timing time = speed_->bare(kind, mode);
      row(table, "bare Embree, " + kind + " rays, " + name(mode), time,
          ray_count / time.median / 1e6, "Mray/s");
    }
  }

  void report_algebra(Table& table) const {
    const auto n = static_cast<double>(model_.patches.size());
    const Timing inverse = timing("inverse"), dgemm = timing("dgemm");
    // n³/3 each for the Cholesky factor, its inverse and their product, 2 per multiply-add.
    const double rate = n * n * n / inverse.median, peak = blas_flops_ / dgemm.median;
    row(table, "inverse of one matrix", inverse, rate / 1e9, "Gflop/s", rate / peak, "dgemm");
    row(table, "dgemm on every thread", dgemm, peak / 1e9, "Gflop/s");
  }

  std::string scene_;
  const OfflineOptions& options_;
  PatchModel model_;
  RayTracer tracer_;
  TiledMatrix<double> matrix_;
  BuildReport report_;
  std::optional<StageSpeed> speed_;
  double blas_flops_ = 0;
  std::map<std::string, std::vector<double>> samples_;  ///< seconds
};

void run(const OfflineOptions& options) {
  Table table({"scene", "patches", "measure", "seconds", "spread", "rate", "unit", "ratio", "of"});
  for (const std::string& scene : options.scenes) {
    OfflineStage stage(scene, options);
    stage.measure();
    stage.report(table);
  }
  publish("offline", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  rebounce::bench::OfflineOptions options;
  CLI::App app("Times the offline stage by phase, beside bare Embree and BLAS in the same run.",
               "bench_offline");
  rebounce::bench::add_scene_option(app, options.scenes);
  rebounce::bench::add_patch_option(app, options.settings.subdivision.patch_count);
  app.add_option("--ray-limit", options.ray_limit,
                 "Rays that lie ready for bare Embree at most, about 100 bytes each")
      ->check(CLI::Range(1e3, 1e9))
      ->capture_default_str();
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}
