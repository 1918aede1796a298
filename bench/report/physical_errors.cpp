#include "bench/report/physical_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/reference/scene_key_light.h"
#include "precompute/build/transfer_build.h"
#include "precompute/lights/reference_solution.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/patches/winding.h"
#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "transfer/base/area_norm.h"

namespace rebounce::bench {
namespace {

// Form factors as good as can be had in reasonable time.
constexpr int kManyRays = 256;
constexpr double kFineKernel = 1e-5;

/// The scene under its key light, as the path tracer sees it.
class TruthScene {
 public:
  explicit TruthScene(const std::string& path)
      : scene_(import_usable(path, 1)),
        tracer_(reference::make_scene_tracer(scene_)),
        sides_(find_lit_sides(scene_, tracer_)),
        lights_{reference::make_key_light(scene_, tracer_, sides_)} {}

  reference::LitScene lit() const { return {scene_, tracer_, lights_, {}}; }
  const std::vector<Light>& lights() const { return lights_; }
  std::vector<reference::SurfacePoint> points(std::size_t count, std::uint64_t seed) const {
    return reference::sample_surface(scene_, sides_, count, seed);
  }

 private:
  Scene scene_;
  RayTracer tracer_;
  std::vector<TriangleSides> sides_;
  std::vector<Light> lights_;
};

/// H [n] in lx of the same patches with better form factors.
std::vector<Float3> better_solution(const std::string& scene, const ReportSettings& settings,
                                    std::span<const Float3> exitance,
                                    const ReportProgress& progress) {
  BuildSettings build;
  build.subdivision.patch_count = settings.patch_count;
  build.form_factors.seed = settings.seed + 1;
  build.form_factors.probe_rays = settings.truth_probe_rays;
  build.form_factors.full_rays = kManyRays;
  build.form_factors.kernel_tolerance = kFineKernel;
  build.operator_kind = OperatorKind::kNoOperator;
  build.store_form_factors = true;
  BuildReport report;
  const auto phase = [&](std::string_view name, double part) {
    return progress(fmt::format("better {}", name), part);
  };
  const TransferData data = build_transfer_data(scene, build, report, phase);
  return ReferenceSolver(data.exchange, data.patches).indirect_irradiance(exitance);
}

}  // namespace

TruthResult measure_truth(const std::string& scene, const Contenders& contenders,
                          const ReportSettings& settings, const ReportProgress& progress) {
  const auto phase = [&](const char* name) {
    return Progress([&progress, name](double part) { return progress(name, part); });
  };
  const TransferData& data = *contenders.data;
  const TruthScene truth(scene);
  Engine engine(contenders.data);
  engine.relight(truth.lights(), {});
  const auto exitance = engine.initial_exitance();
  const auto compressed =
      product(*contenders.transfer(hierarchical_name(kDefaultTolerance)), exitance);
  const auto dense = product(*data.transfer, exitance);
  const auto better = better_solution(scene, settings, exitance, progress);

  TruthResult result;
  const reference::PatchComparison means = reference::compare_patch_means(
      data, compressed, truth.lit(), settings.patch_comparison, phase("truth on patches"));
  result.patch_means = means.relative;
  result.discretisation = reference::compare_patch_means(means, better);
  const auto points = truth.points(settings.truth_point_count, settings.seed);
  const auto at_points = reference::indirect_irradiance(truth.lit(), points, settings.truth_samples,
                                                        settings.seed, phase("truth at points"));
  result.reconstruction =
      reference::compare_reconstruction(data, *contenders.tracer, compressed, points, at_points)
          .relative;
  result.form_factors = relative_difference(dense, better, data.patches.area);
  result.compression = relative_difference(compressed, dense, data.patches.area);
  return result;
}

FurnaceResult measure_furnace(const TransferData& data) {
  constexpr float kReflectance = 0.5F, kEmission = 1;
  constexpr float kRadiosity = kEmission / (1 - kReflectance);
  PatchTable patches = data.patches;
  std::vector<Float3> light(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    patches.reflectance[i].fill(kReflectance);
    const float opening = patches.sky_visibility[i] + patches.absorbed[i];
    light[i].fill(kEmission + kReflectance * opening * kRadiosity);
  }
  const auto radiosity = ReferenceSolver(data.exchange, patches).radiosity(light);
  FurnaceResult result;
  double area = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const double error = std::abs(radiosity[i][0] / kRadiosity - 1);
    result.error_mean += patches.area[i] * error;
    result.error_max = std::max(result.error_max, error);
    area += patches.area[i];
  }
  result.error_mean /= area;
  return result;
}

}  // namespace rebounce::bench
