// The offline stage by phase, beside what bare Embree and BLAS reach in the same run.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "bare_embree.h"
#include "blas_peak.h"
#include "program.h"
#include "rebounce/precompute/build.h"
#include "rebounce/precompute/import_gltf.h"
#include "rebounce/transfer/error.h"
#include "shadow_rays.h"
#include "stage_rays.h"
#include "tiled_cholesky.h"
#include "timing.h"

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
TiledMatrix test_matrix(std::size_t n) {
  TiledMatrix matrix(n);
  const double off_diagonal = -0.5 / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i / TiledMatrix::kTile < j / TiledMatrix::kTile) break;
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
        model_(make_patch_model(import_gltf(scene), options.settings.subdivision)),
        tracer_(model_.mesh.position,
                std::span(model_.mesh.triangle).first(model_.mesh.surface_count())),
        geometry_(model_, tracer_, ff_settings().seed),
        shadow_rays_(geometry_, ff_settings().seed, ff_settings().kernel_tolerance),
        matrix_(test_matrix(model_.patches.size())) {}

  void measure() {
    build_transfer_data(scene_, options_.settings, report_);
    choose_rows();
    const StageRays rays = make_stage_rays(model_, tracer_, ff_settings(), row_step_);
    sampled_shadow_count_ = rays.shadow_count;
    sampled_escape_count_ = rays.escape_count;
    BareEmbree embree(model_.mesh, rays);
    BlasPeak blas;
    blas_flops_ = blas.flops();
    for (int repeat = 0; repeat < options_.common.repeats; ++repeat) {
      measure_stage();
      measure_embree(embree, rays.hidden_count);
      add("pairs", [&] { find_pairs(); });
      TiledMatrix matrix = matrix_;
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

  /// Takes as many rows, evenly spread, as keep the rays that lie ready below the limit.
  void choose_rows() {
    const double parts = static_cast<double>(report_.ray_count) / options_.ray_limit;
    row_step_ = static_cast<std::uint32_t>(std::max(1.0, std::ceil(parts)));
  }

  void add(const std::string& what, const std::function<void()>& work) {
    samples_[what].push_back(seconds_of(work));
  }

  void measure_stage() {
    report_ = {};
    build_transfer_data(scene_, options_.settings, report_);
    for (const auto& [phase, seconds] : report_.seconds) samples_[phase].push_back(seconds);
  }

  void measure_embree(BareEmbree& embree, std::uint64_t hidden_count) {
    for (const TraceMode mode : kTraceModes) {
      embree.reset();
      add(std::string("shadow ") + name(mode), [&] { embree.trace_shadow(mode); });
      add(std::string("escape ") + name(mode), [&] { embree.trace_escape(mode); });
      check_agreement(embree.hidden_count(), hidden_count);
    }
  }

  /// Embree's packets and single rays round differently, so that a ray in a million that grazes an
  /// edge may go either way; a mode that traced something else would be off by far more.
  void check_agreement(std::uint64_t hidden_count, std::uint64_t expected) const {
    constexpr double kTolerance = 1e-4;
    const double difference =
        std::abs(static_cast<double>(hidden_count) - static_cast<double>(expected));
    if (difference <= kTolerance * static_cast<double>(sampled_shadow_count_)) return;
    throw Error("bare Embree and the ray tracer disagree on " + scene_ + ": " +
                std::to_string(hidden_count) + " hidden rays, not " + std::to_string(expected));
  }

  void find_pairs() {
    std::uint64_t pairs = 0;
#pragma omp parallel reduction(+ : pairs)
    {
      std::vector<FacingPatch> facing;
#pragma omp for schedule(dynamic, 4)
      for (std::size_t i = 0; i < geometry_.patch_count(); i += row_step_) {
        shadow_rays_.find_facing(static_cast<std::uint32_t>(i), facing,
                                 [](std::uint32_t) { return true; });
        pairs += facing.size();
      }
    }
    sampled_pair_count_ = pairs;
  }

  Timing timing(const std::string& what) const {
    return summarise(samples_.at(what));
  }

  void row(Table& table, const std::string& what, const Timing& time, const Table::Cell& rate = {},
           const Table::Cell& unit = {}, const Table::Cell& ratio = {},
           const Table::Cell& baseline = {}) const {
    table.add({std::filesystem::path(scene_).stem().string(), model_.patches.size(), what,
               time.median, time.spread, rate, unit, ratio, baseline});
  }

  /// The fastest mode's median seconds for the sampled rays of `kind`.
  double fastest(const std::string& kind) const {
    double seconds = std::numeric_limits<double>::infinity();
    for (const TraceMode mode : kTraceModes) {
      seconds = std::min(seconds, timing(kind + " " + name(mode)).median);
    }
    return seconds;
  }

  void report_form_factors(Table& table) const {
    const Timing phase = timing("form factors");
    const auto rays = static_cast<double>(report_.ray_count);
    const double escape = static_cast<double>(model_.patches.size()) * ff_settings().hemisphere_rays;
    // Seconds of bare Embree for all rays of the phase, in the proportion of their kinds.
    const double bare =
        (rays - escape) * fastest("shadow") / static_cast<double>(sampled_shadow_count_) +
        escape * fastest("escape") / static_cast<double>(sampled_escape_count_);
    row(table, "form factors", phase, rays / phase.median / 1e6, "Mray/s", bare / phase.median,
        "bare Embree, same rays");
    const Timing pairs = timing("pairs");
    const double scale =
        static_cast<double>(report_.pair_count) / static_cast<double>(sampled_pair_count_);
    row(table, "pairs and kernel alone", {pairs.median * scale, pairs.spread},
        static_cast<double>(sampled_pair_count_) / pairs.median / 1e6, "Mpair/s",
        pairs.median * scale / phase.median, "form factors");
    report_embree(table, "shadow", static_cast<double>(sampled_shadow_count_));
    report_embree(table, "escape", static_cast<double>(sampled_escape_count_));
  }

  void report_embree(Table& table, const std::string& kind, double ray_count) const {
    for (const TraceMode mode : kTraceModes) {
      const Timing time = timing(kind + " " + name(mode));
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
  PatchGeometry geometry_;
  ShadowRays shadow_rays_;
  TiledMatrix matrix_;
  BuildReport report_;
  std::uint32_t row_step_ = 1;
  std::uint64_t sampled_shadow_count_ = 0, sampled_escape_count_ = 0, sampled_pair_count_ = 0;
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
  app.add_option("scenes", options.scenes, "Scenes (.glb or .gltf)")->required();
  app.add_option("--patches", options.settings.subdivision.patch_count,
                 "Subdivide until there are about this many patches")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--ray-limit", options.ray_limit,
                 "Rays that lie ready for bare Embree at most, about 100 bytes each")
      ->check(CLI::Range(1e3, 1e9))
      ->capture_default_str();
  add_common_options(app, options.common);
  return rebounce::bench::run_program(app, argc, argv, options.common,
                                      [&] { rebounce::bench::run(options); });
}
