// Links against all pairs of patches: how many, how many rays, how far off.
//
// All pairs are looked at for some rows only, so that n may be large.

#include <CLI/CLI.hpp>
#include <cmath>
#include <numeric>

#include "bench/input.h"
#include "bench/program.h"
#include "bench/timing.h"
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/patch_geometry.h"
#include "precompute/exchange/pairs/row_sum_targets.h"
#include "precompute/exchange/pairs/shadow_rays.h"
#include "runtime/rays/box.h"

namespace rebounce::bench {
namespace {

// Rows of all pairs that are off by more than this get all rays.
constexpr double kRowSumTolerance = 0.005;

struct LinksOptions {
  std::vector<std::string> scenes;
  std::vector<std::size_t> patches = {1000, 4000};
  std::vector<double> epsilons = {kLinkEpsilon};
  std::size_t row_count = 192;  ///< of all pairs that are looked at
  CommonOptions common{.repeats = 1};
};

/// Some rows of F, from all pairs, each scaled to what escape leaves of 1.
struct SampledRows {
  std::vector<std::uint32_t> patch;
  std::vector<std::vector<double>> form_factor;  ///< [rows][n]
  double rays_of_all = 0;                        ///< that all rows would take
  double seconds_of_all = 0;
};

/// The rays of some pairs of patches, as many for each.
struct TracedRays {
  std::vector<Ray> ray;
  std::vector<float> transmitted;  ///< of each ray

  std::span<const Ray> of_pair(std::size_t pair, std::size_t count) const {
    return std::span(ray).subspan(pair * count, count);
  }
  std::span<const float> transmitted_of_pair(std::size_t pair, std::size_t count) const {
    return std::span(transmitted).subspan(pair * count, count);
  }
};

class SceneBench {
 public:
  SceneBench(const std::string& scene, std::size_t patch_count, const LinksOptions& options)
      : options_(options),
        model_(model_of_scene(scene, patch_count)),
        tracer_(make_surface_tracer(model_.mesh)),
        geometry_(model_, tracer_),
        shadow_rays_(geometry_, settings_.seed, settings_.kernel_tolerance) {
    sample_rows();
  }

  void measure(double epsilon, const std::string& name, Table& table) {
    settings_.link_epsilon = epsilon;
    LinkBuild build;
    const double seconds = seconds_of([&] { build = build_links(model_, tracer_, settings_); });
    const auto n = static_cast<double>(model_.patches.size());
    const double rays = static_cast<double>(build.ray_count) - n * settings_.hemisphere_rays;
    const LinkedFormFactors links(build.links, model_.patches.area, model_.patches.centroid);
    table.add({name, n, epsilon, build.links.pair.size(),
               static_cast<double>(build.links.pair.size()) / (n * n), rays,
               rays / rows_.rays_of_all, seconds / rows_.seconds_of_all, matrix_error(links),
               gather_error(links)});
  }

 private:
  void sample_rows() {
    const std::size_t n = model_.patches.size(), count = std::min(n, options_.row_count);
    for (std::size_t k = 0; k < count; ++k) {
      rows_.patch.push_back(static_cast<std::uint32_t>((2 * k + 1) * n / (2 * count)));
    }
    rows_.form_factor.resize(count);
    std::uint64_t rays = 0;
    const double seconds = seconds_of([&] {
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : rays)
      for (std::size_t k = 0; k < count; ++k)
        rays += compute_row(rows_.patch[k], settings_.probe_rays, rows_.form_factor[k]);
    });
    // Every pair is in two rows.
    const double all = 0.5 * static_cast<double>(n) / static_cast<double>(count);
    rows_.rays_of_all = all * static_cast<double>(rays);
    rows_.seconds_of_all = all * seconds;
    scale_to_targets();
  }

  /// As form_factors.h has it: with `probe_rays`, and more where these disagree. Returns the number
  /// of rays.
  std::uint64_t compute_row(std::uint32_t i, int probe_rays, std::vector<double>& row) const {
    std::vector<FacingPatch> facing, mixed;
    TracedRays rays;
    row.assign(model_.patches.size(), 0.0);
    for (std::uint32_t j = 0; j < row.size(); ++j) {
      const double exchange =
          i == j && geometry_.bounds(i).is_flat() ? 0 : shadow_rays_.unoccluded(i, j);
      if (exchange > 0) facing.push_back({j, exchange});
    }
    std::uint64_t count = trace(i, facing, probe_rays, rays);
    for (std::size_t p = 0; p < facing.size(); ++p) {
      const auto agreement = ShadowRays::agreement(rays.of_pair(p, probe_rays),
                                                   rays.transmitted_of_pair(p, probe_rays));
      if (agreement == ShadowRays::Agreement::kMixed) mixed.push_back(facing[p]);
      if (agreement == ShadowRays::Agreement::kClear) {
        row[facing[p].patch] = facing[p].unoccluded / geometry_.area(i);
      }
    }
    count += trace(i, mixed, settings_.full_rays, rays);
    for (std::size_t p = 0; p < mixed.size(); ++p) {
      const int full = settings_.full_rays;
      const double visible =
          ShadowRays::visibility(rays.of_pair(p, full), rays.transmitted_of_pair(p, full)).part;
      row[mixed[p].patch] = visible * mixed[p].unoccluded / geometry_.area(i);
    }
    return count;
  }

  std::uint64_t trace(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                      TracedRays& rays) const {
    shadow_rays_.make_rays(i, facing, count, rays.ray);
    rays.transmitted.resize(rays.ray.size());
    tracer_.transmittance(rays.ray, PassageDetail::kTriangle, rays.transmitted);
    return rays.ray.size();
  }

  void scale_to_targets() {
    const PatchTriangles triangles(model_.mesh.triangle_patch, model_.patches.size());
    EscapeScratch scratch;
    std::vector<Escape> escape;
    for (const std::uint32_t patch : rows_.patch) {
      escape.push_back(measure_escape(model_, triangles[patch], patch, tracer_,
                                      settings_.hemisphere_rays, settings_.seed, scratch));
    }
    const std::vector<RowSumTarget> target = row_sum_targets(escape, settings_.hemisphere_rays);
    for (std::size_t k = 0; k < target.size(); ++k) {
      auto& row = rows_.form_factor[k];
      double sum = std::accumulate(row.begin(), row.end(), 0.0);
      if (is_doubtful_row(sum, target[k], kRowSumTolerance)) {
        compute_row(rows_.patch[k], settings_.full_rays, row);
        sum = std::accumulate(row.begin(), row.end(), 0.0);
      }
      if (sum <= 0) continue;
      for (double& f : row) f *= target[k].sum / sum;
    }
  }

  /// Of the symmetric form, Frobenius, over the sampled rows.
  double matrix_error(const LinkedFormFactors& links) const {
    const std::size_t n = model_.patches.size(), count = rows_.patch.size();
    std::vector<Float3> unit(n, {0, 0, 0}), column(n);
    std::vector<float> workspace(links.workspace_size());
    double difference = 0, norm = 0;
    for (std::size_t first = 0; first < count; first += kChannelCount) {
      const auto wide = std::min<std::size_t>(kChannelCount, count - first);
      for (std::size_t c = 0; c < wide; ++c) unit[rows_.patch[first + c]][c] = 1;
      links.gather(unit, column, workspace);
      for (std::size_t c = 0; c < wide; ++c) {
        const std::uint32_t i = rows_.patch[first + c];
        unit[i][c] = 0;
        for (std::size_t j = 0; j < n; ++j) {
          const double scale = std::sqrt(geometry_.area(i) / geometry_.area(j));
          const double g = rows_.form_factor[first + c][j] * scale;
          const double d = column[j][c] / scale - g;
          difference += d * d;
          norm += g * g;
        }
      }
    }
    return std::sqrt(difference / norm);
  }

  std::vector<Float3> smooth_light() const {
    const Box box = box_around(model_.patches.centroid);
    const glm::dvec3 low(box.low), high(box.high);
    std::vector<Float3> light;
    for (const Float3& p : model_.patches.centroid) {
      double sum = 1;
      for (int k = 0; k < 3; ++k) {
        sum += 0.5 * std::sin(3 * (p[k] - low[k]) / (high[k] - low[k]) + k);
      }
      light.push_back({static_cast<float>(sum), 0, 0});
    }
    return light;
  }

  double gather_error(const LinkedFormFactors& links) const {
    const std::vector<Float3> light = smooth_light();
    const std::vector<Float3> arrived = gather(links, light);
    double difference = 0, norm = 0;
    for (std::size_t k = 0; k < rows_.patch.size(); ++k) {
      double wanted = 0;
      for (std::size_t j = 0; j < light.size(); ++j) {
        wanted += rows_.form_factor[k][j] * light[j][0];
      }
      const double area = geometry_.area(rows_.patch[k]);
      difference += area * std::pow(arrived[rows_.patch[k]][0] - wanted, 2);
      norm += area * wanted * wanted;
    }
    return std::sqrt(difference / norm);
  }

  const LinksOptions& options_;
  FormFactorSettings settings_;
  PatchModel model_;
  RayTracer tracer_;
  PatchGeometry geometry_;
  ShadowRays shadow_rays_;
  SampledRows rows_;
};

void run(const LinksOptions& options) {
  Table table({"scene", "patches", "epsilon", "links", "links / n2", "rays", "/ all pairs",
               "time / all pairs", "error of F", "error of F B"});
  for (const std::string& scene : options.scenes) {
    const std::string name = scene_name(scene);
    for (const std::size_t patches : options.patches) {
      SceneBench bench(scene, patches, options);
      for (const double epsilon : options.epsilons) bench.measure(epsilon, name, table);
    }
  }
  publish("links", table, options.common);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  using namespace rebounce::bench;
  LinksOptions options;
  CLI::App app("Links between sets of patches beside all pairs of patches", "bench_links");
  add_scene_option(app, options.scenes);
  add_patches_option(app, options.patches);
  app.add_option("--epsilon", options.epsilons, "Errors that a link may have")
      ->capture_default_str();
  app.add_option("--rows", options.row_count, "Rows of F that are found from all pairs")
      ->capture_default_str();
  add_common_options(app, options.common);
  return run_program(app, argc, argv, options.common, [&] { run(options); });
}
