#include "rebounce/precompute/build.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "rebounce/precompute/dense_transfer.h"
#include "rebounce/precompute/fitting_lights.h"
#include "rebounce/precompute/form_factor_compression.h"
#include "rebounce/precompute/hierarchical_transfer.h"
#include "rebounce/precompute/import_gltf.h"
#include "rebounce/precompute/link_coarsening.h"
#include "rebounce/precompute/links.h"
#include "rebounce/precompute/low_rank_transfer.h"
#include "rebounce/precompute/measured_error.h"
#include "rebounce/precompute/patch_model.h"
#include "rebounce/precompute/reconstruction_weights.h"
#include "rebounce/precompute/winding.h"
#include "rebounce/transfer/error.h"
#include "rebounce/transfer/version.h"

namespace rebounce {
namespace {

// Lights that compressed form factors are measured under.
constexpr int kTestLightCount = 16;

// A residual above this is not rounding but a mistake; f32 and f16 entries.
constexpr double kLargestResidualF32 = 1e-4, kLargestResidualF16 = 5e-3;

std::uint64_t machine_memory_bytes() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

CostEstimate estimate_cost(const PatchModel& model, int probe_rays) {
  const PatchTable& patches = model.patches;
  std::array<std::uint32_t, kChannelCount> channel_matrix{};
  const std::uint32_t matrices = distinct_channels(patches.reflectance, channel_matrix);
  const auto n = static_cast<double>(patches.size());
  CostEstimate estimate;
  estimate.patch_count = patches.size();
  // Form factors at their fullest: half of all pairs, 16 bytes each while they are made and 24 when
  // they are compressed and expanded; then the inversion beside the compressed ones.
  const double factors = n * n / 4;
  estimate.peak_bytes = static_cast<std::uint64_t>(std::max(
      40 * factors,
      8 * factors + static_cast<double>(dense_transfer_peak_bytes(patches.size(), matrices))));
  // Ten million rays, fifty billion operations and eighty thousand vertices a second, about one
  // slow core.
  estimate.seconds = factors * probe_rays / 1e7 + 2 * n * n * n * matrices / 5e10 +
                     static_cast<double>(model.mesh.position.size()) / 8e4;
  return estimate;
}

std::string in_gib(std::uint64_t bytes) {
  return fmt::format("{:.3g} GiB", static_cast<double>(bytes) / (1ULL << 30));
}

void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count) {
  const std::uint64_t limit = limit_bytes > 0 ? limit_bytes : machine_memory_bytes() / 2;
  if (estimate.peak_bytes <= limit) return;
  throw Error(fmt::format(
      "{} patches (from {} triangles) need about {} and the limit is {}; ask for "
      "fewer patches, simplify the scene or raise --memory-limit",
      estimate.patch_count, triangle_count, in_gib(estimate.peak_bytes), in_gib(limit)));
}

/// Times phases and passes their progress on.
class PhaseClock {
 public:
  PhaseClock(BuildReport& report, const BuildProgress& progress)
      : report_(report), progress_(progress) {}

  template <typename Work>
  auto run(const char* phase, const Work& work) {
    const Progress progress = [this, phase](double fraction) {
      return !progress_ || progress_(phase, fraction);
    };
    if (!progress(0)) throw Cancelled();
    const auto begin = std::chrono::steady_clock::now();
    auto result = work(progress);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    report_.seconds.emplace_back(phase, seconds.count());
    if (!progress(1)) throw Cancelled();
    return result;
  }

 private:
  BuildReport& report_;
  const BuildProgress& progress_;
};

void describe_patches(const PatchModel& model, BuildReport& report) {
  report.display_triangle_count = model.mesh.triangle.size();
  report.patch_count = model.patches.size();
  report.sliver_count = model.sliver_count;
  report.unlit_side_count = model.unlit_side_count;
  report.covered_side_count = model.covered_side_count;
  report.opening_side_count = model.opening_side_count;
  report.buried_side_count = model.buried_side_count;
  std::vector<float> size(model.patches.area);
  for (float& s : size) s = std::sqrt(s);
  std::ranges::sort(size);
  report.patch_size_min = size.front();
  report.patch_size_median = size[size.size() / 2];
  report.patch_size_max = size.back();
  report.warnings.insert(report.warnings.end(), model.warnings.begin(), model.warnings.end());
}

/// The settings with what was left open decided.
BuildSettings decide(BuildSettings settings, std::size_t patch_count) {
  if (settings.operator_kind == OperatorKind::kAutomatic) {
    settings.operator_kind =
        patch_count <= kDensePatchCount ? OperatorKind::kDense : OperatorKind::kHierarchical;
  }
  const bool hierarchical = settings.operator_kind == OperatorKind::kHierarchical;
  if (!settings.precision) {
    const bool dense = settings.operator_kind == OperatorKind::kDense;
    settings.precision = hierarchical ? Precision::kQ16 : dense ? Precision::kF32 : Precision::kF16;
  }
  const bool integers =
      settings.precision == Precision::kQ16 || settings.precision == Precision::kQ8;
  if (integers && !hierarchical) {
    throw Error("integers are for hierarchical operators alone; use f16 or f32, or ask for one");
  }
  if (settings.operator_kind != OperatorKind::kHierarchical) settings.tolerance = 0;
  return settings;
}

const char* name(OperatorKind kind) {
  switch (kind) {
    case OperatorKind::kHierarchical:
      return "hierarchical";
    case OperatorKind::kLowRank:
      return "low-rank";
    case OperatorKind::kFirstBounce:
      return "first-bounce";
    case OperatorKind::kNoOperator:
      return "none";
    case OperatorKind::kAutomatic:
    case OperatorKind::kDense:
      break;
  }
  return "dense";
}

std::string settings_json(const BuildSettings& settings) {
  const FormFactorSettings& f = settings.form_factors;
  return nlohmann::json{{"operator", name(settings.operator_kind)},
                        {"tolerance", settings.tolerance},
                        {"form_factor_tolerance", settings.form_factor_tolerance},
                        {"rank", settings.rank},
                        {"scale", settings.scale},
                        {"precision", precision_name(*settings.precision)},
                        {"patches", settings.subdivision.patch_count},
                        {"patch_size", settings.subdivision.patch_size},
                        {"seed", f.seed},
                        {"probe_rays", f.probe_rays},
                        {"full_rays", f.full_rays},
                        {"hemisphere_rays", f.hemisphere_rays},
                        {"link_epsilon", f.link_epsilon},
                        {"store_links", settings.store_links},
                        {"kernel_tolerance", f.kernel_tolerance},
                        {"probe_grid", settings.probes.grid},
                        {"probe_spacing", settings.probes.spacing},
                        {"probe_rays_each", settings.probes.ray_count},
                        {"surface_harmonic_rays", settings.surface_harmonics.ray_count},
                        {"lightmap_size", settings.lightmap.size},
                        {"lightmap_padding", settings.lightmap.padding}}
      .dump();
}

/// The part of the report that is the same in every run: it goes into the file, times do not.
std::string report_json(const BuildReport& report, const std::vector<KindError>& errors) {
  nlohmann::json by_kind = nlohmann::json::object();
  for (const KindError& e : errors) {
    by_kind[std::string(name(e.kind))] = {
        {"lights", e.light_count}, {"mean", e.mean}, {"max", e.max}, {"bound", e.bound}};
  }
  nlohmann::json json{{"triangles", report.triangle_count},
                      {"degenerate_triangles", report.degenerate_triangle_count},
                      {"display_triangles", report.display_triangle_count},
                      {"slivers", report.sliver_count},
                      {"unlit_sides", report.unlit_side_count},
                      {"covered_sides", report.covered_side_count},
                      {"opening_sides", report.opening_side_count},
                      {"buried_sides", report.buried_side_count},
                      {"patch_size_min", report.patch_size_min},
                      {"patch_size_median", report.patch_size_median},
                      {"patch_size_max", report.patch_size_max},
                      {"rays", report.ray_count},
                      {"pairs", report.pair_count},
                      {"form_factors", report.form_factor_count},
                      {"links", report.link_count},
                      {"row_sum_error_before", report.closure.row_sum_error_before},
                      {"row_sum_error_after", report.closure.row_sum_error_after},
                      {"closure_change", report.closure.relative_change},
                      {"errors", by_kind},
                      {"warnings", report.warnings}};
  if (report.form_factor_error) {
    json["form_factor_error_mean"] = report.form_factor_error->mean;
    json["form_factor_error_max"] = report.form_factor_error->max;
  }
  return json.dump();
}

void check_residual(double residual, Precision precision) {
  const double largest = precision == Precision::kF16 ? kLargestResidualF16 : kLargestResidualF32;
  if (residual <= largest) return;
  throw Error(
      fmt::format("the operator fails its own check: residual {:.2e} where {:.0e} is allowed; "
                  "please report this scene",
                  residual, largest));
}

std::shared_ptr<const TransferOperator> compress(const DenseOperator& dense,
                                                 const TransferData& data, const RayTracer& tracer,
                                                 const BuildSettings& settings,
                                                 const Progress& progress) {
  if (settings.operator_kind != OperatorKind::kHierarchical) {
    const bool first_bounce = settings.operator_kind == OperatorKind::kFirstBounce;
    return build_low_rank_transfer(dense, data.exchange,
                                   {settings.rank, *settings.precision, first_bounce}, progress);
  }
  const DrawnLights lights = draw_fitting_lights(data, tracer, settings.form_factors.seed);
  return build_hierarchical_transfer(dense, data.patches, lights.view(),
                                     {settings.tolerance, *settings.precision}, progress);
}

/// Compresses the form factors of `data` and measures how well, with data.transfer as it is.
void compress_form_factors_of(TransferData& data, const RayTracer& tracer,
                              const BuildSettings& settings, BuildReport& report,
                              const Progress& progress) {
  const std::uint64_t seed = settings.form_factors.seed;
  const DrawnLights fitting = radiosities_of(draw_fitting_lights(data, tracer, seed), data);
  data.compressed_form_factors =
      compress_form_factors(data.exchange, data.patches, fitting.view(),
                            {settings.form_factor_tolerance, Precision::kF16}, progress);
  report.form_factor_error = form_factor_error(
      *data.compressed_form_factors, data.exchange, data.patches,
      radiosities_of(
          *data.transfer, data.patches.reflectance,
          random_initial_exitances(data, tracer, LightKind::kPoint, kTestLightCount, seed)));
}

/// Mean and largest are those of point lights, which the tolerance is about; the bound holds for
/// every kind.
void record_errors(const std::vector<KindError>& errors, BuildRecord& record) {
  for (const KindError& e : errors) {
    record.error_bound = std::max(record.error_bound, e.bound);
    if (e.kind != LightKind::kPoint) continue;
    record.error_mean = e.mean;
    record.error_max = e.max;
  }
}

FormFactorLinks find_links(const PatchModel& model, const RayTracer& tracer,
                           FormFactorSettings settings, const Progress& progress) {
  if (settings.link_epsilon == 0) settings.link_epsilon = kLinkEpsilon;
  return coarsen_links(build_links(model, tracer, settings, {}, progress).links, model.patches.area,
                       model.patches.centroid, kLinkCoarsening * settings.link_epsilon);
}

Lightmap make_lightmap(const PatchModel& model, const BuildSettings& settings,
                       BuildReport& report) {
  PlacedLightmap placed = place_lightmap(model, settings.lightmap);
  for (const std::string& warning : placed.warnings) {
    report.warnings.push_back(warning + ": it is left out of the lightmap");
  }
  return std::move(placed.lightmap);
}

/// The offline stage, a step at a time, each with what the steps before have left.
class TransferBuild {
 public:
  TransferBuild(const BuildSettings& settings, BuildReport& report, const BuildProgress& progress)
      : settings_(settings), report_(report), clock_(report, progress) {}

  Scene import_scene(const std::filesystem::path& path) {
    Scene scene =
        clock_.run("import", [&](const Progress&) { return import_usable(path, settings_.scale); });
    report_.triangle_count = scene.triangle.size();
    report_.degenerate_triangle_count = scene.degenerate_triangle_count;
    report_.warnings = scene.warnings;
    data_.materials = scene.materials;
    data_.textures = scene.textures;
    data_.cameras = scene.cameras;
    data_.lights = scene.lights;
    data_.record.generator = std::string("rebounce ") + version();
    data_.record.scene_name = scene.name;
    data_.record.scene_hash = scene.hash;
    return scene;
  }

  /// Throws Error if the rest would need more memory than it may take, or cannot be made as asked.
  void make_patches(Scene scene, const EstimateListener& on_estimate) {
    model_ = clock_.run("patches", [&](const Progress& part) {
      return make_patch_model(std::move(scene), settings_.subdivision, part);
    });
    describe_patches(model_, report_);
    if (settings_.lightmap.size > 0) {
      data_.lightmap = clock_.run(
          "lightmap", [&](const Progress&) { return make_lightmap(model_, settings_, report_); });
    }
    decided_ = decide(settings_, model_.patches.size());
    report_.estimate = estimate_cost(model_, settings_.form_factors.probe_rays);
    if (on_estimate) on_estimate(report_.estimate);
    refuse_if_too_large(report_.estimate, settings_.memory_limit_bytes, report_.triangle_count);
  }

  /// Finds what patches exchange; afterwards the patches and the mesh are the data's.
  void find_exchange() {
    const RayTracer& tracer = tracer_.emplace(make_surface_tracer(model_.mesh));
    FormFactors form_factors = clock_.run("form factors", [&](const Progress& part) {
      return compute_form_factors(model_, tracer, settings_.form_factors, part);
    });
    report_.ray_count = form_factors.ray_count;
    report_.pair_count = form_factors.pair_count;
    report_.form_factor_count = form_factors.exchange.column.size();
    report_.closure = form_factors.closure;
    if (settings_.store_links) {
      data_.links = clock_.run("links", [&](const Progress& part) {
        return find_links(model_, tracer, settings_.form_factors, part);
      });
      report_.link_count = data_.links.pair.size();
    }
    data_.patches = std::move(model_.patches);
    data_.patches.sky_visibility = std::move(form_factors.sky_visibility);
    data_.patches.absorbed = std::move(form_factors.absorbed);
    data_.sky_cells = std::move(form_factors.sky_cells);
    data_.mesh = std::move(model_.mesh);
    data_.exchange = std::move(form_factors.exchange);
  }

  /// What takes the light of patches to where it is shown.
  void make_outputs() {
    clock_.run("weights", [&](const Progress& part) {
      compute_reconstruction_weights(model_.shown_patch, data_.patches.absorbed, *tracer_,
                                     data_.mesh, part);
      return true;
    });
    if (settings_.probes.grid[0] > 0 || settings_.probes.spacing > 0) {
      data_.probes = clock_.run("probes", [&](const Progress& part) {
        LightProbes probes = place_probes(data_.mesh, settings_.probes);
        trace_probes(data_, model_.shown_patch, *tracer_, settings_.probes, probes, part);
        return probes;
      });
    }
    if (settings_.surface_harmonics.ray_count > 0) {
      data_.surface_harmonics = clock_.run("surface harmonics", [&](const Progress& part) {
        return trace_surface_harmonics(data_, model_.shown_patch, *tracer_,
                                       settings_.surface_harmonics, part);
      });
    }
  }

  /// Makes the operator, and measures how far off it is.
  void make_operator() {
    if (decided_.operator_kind == OperatorKind::kNoOperator) return;
    const bool compressed = decided_.operator_kind != OperatorKind::kDense;
    const Precision dense_precision = compressed ? Precision::kF32 : *decided_.precision;
    const auto dense = clock_.run("operator", [&](const Progress& part) {
      return build_dense_transfer(data_.exchange, data_.patches, dense_precision, part);
    });
    check_residual(transfer_residual(*dense, data_.exchange, data_.patches), dense_precision);
    data_.transfer = dense;
    if (compressed) {
      data_.transfer = clock_.run("compression", [&](const Progress& part) {
        return compress(*dense, data_, *tracer_, decided_, part);
      });
    }
    if (decided_.form_factor_tolerance > 0) {
      clock_.run("form factor compression", [&](const Progress& part) {
        compress_form_factors_of(data_, *tracer_, decided_, report_, part);
        return true;
      });
    }
    check(compressed ? dense.get() : nullptr);
  }

  TransferData take() { return std::move(data_); }

 private:
  void check(const DenseOperator* exact) {
    const std::vector<KindError> errors = clock_.run("check", [&](const Progress& part) {
      data_.record.solve_residual =
          transfer_residual(*data_.transfer, data_.exchange, data_.patches);
      return measure_error(data_, *tracer_, exact, settings_.form_factors.seed, part);
    });
    record_errors(errors, data_.record);
    data_.record.tolerance = decided_.tolerance;
    data_.record.settings_json = settings_json(decided_);
    data_.record.report_json = report_json(report_, errors);
  }

  const BuildSettings& settings_;
  BuildSettings decided_;  ///< settings_ with what was left open decided
  BuildReport& report_;
  PhaseClock clock_;
  TransferData data_;
  PatchModel model_;
  std::optional<RayTracer> tracer_;
};

}  // namespace

Scene import_usable(const std::filesystem::path& path, double scale) {
  Scene scene = import_gltf(path, scale);
  const RayTracer tracer(scene.position, scene.triangle);
  make_double_sided(scene, find_inside_out(scene, tracer));
  return scene;
}

TransferData build_transfer_data(const std::filesystem::path& scene_path,
                                 const BuildSettings& settings, BuildReport& report,
                                 const BuildProgress& progress,
                                 const EstimateListener& on_estimate) {
  TransferBuild build(settings, report, progress);
  build.make_patches(build.import_scene(scene_path), on_estimate);
  build.find_exchange();
  build.make_outputs();
  build.make_operator();
  return build.take();
}

}  // namespace rebounce
