#include "bench/truth/pipeline_solution.h"

#include <cmath>

#include "precompute/build/transfer_build.h"
#include "rebounce/error.h"
#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/default_view.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/area_norm.h"
#include "transfer/base/reflection.h"

namespace rebounce::reference {
namespace {

constexpr SolveMethod kMethod = SolveMethod::kConjugateGradient;

/// |H - truth| of each patch, as a part of the truth's root mean square.
std::vector<float> patch_errors(const Solution& solution, const PatchComparison& patches) {
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

}  // namespace

Solution solve_scene(const std::string& scene, const PipelineSettings& settings,
                     std::span<const Light> lights, const Sky& sky, const BuildProgress& progress) {
  BuildSettings build;
  build.subdivision.patch_count = settings.patch_count;
  build.subdivision.lamp_weight = settings.lamp_weight;
  build.lights = settings.own_lights;
  build.receiver_rows = settings.receiver_rows;
  build.operator_kind =
      settings.receiver_rows.at_vertices ? OperatorKind::kHierarchical : OperatorKind::kNoOperator;
  build.store_form_factors = true;
  build.form_factors = with_quality(settings.quality, build.form_factors);
  BuildReport report;
  TransferData data = build_transfer_data(scene, build, report, progress);
  RayTracer tracer = make_surface_tracer(data.mesh);
  const PatchTable& patches = data.patches;
  std::vector<Float3> exitance(patches.size()), radiosity(patches.size());
  DirectLighting(data, tracer, {.points_per_patch = settings.direct_points})
      .compute(lights, sky, exitance);
  add_reflected(patches.emitted_exitance, patches.reflectance, exitance, exitance);
  const auto form_factors = make_form_factors(kMethod, data.exchange, patches.area);
  const SolveResult result = solve_radiosity(
      kMethod, *form_factors, {patches.area, patches.reflectance}, exitance, {}, radiosity);
  if (!result.converged) throw Error(scene + ": the solver did not converge");
  std::vector<Float3> indirect = gather(*form_factors, radiosity);
  return {std::move(data), std::move(tracer), std::move(indirect), std::move(radiosity)};
}

void draw_error(const Solution& solution, const PatchComparison& patches, const std::string& path) {
  const TransferData& data = solution.data;
  const std::vector<float> error = patch_errors(solution, patches);
  PictureSettings settings;
  settings.show = Show::kError;
  settings.camera = default_camera(data, solution.tracer);
  PictureLight light;
  light.error = error;
  write_png(path, tone_map(render_picture(data, solution.tracer, light, settings)));
}

}  // namespace rebounce::reference
