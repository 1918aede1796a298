#include "bench/truth/error_causes.h"

#include <glm/glm.hpp>

#include "precompute/patches/hit_patch.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "rebounce/error.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/reflection.h"

namespace rebounce::reference {
namespace {

// Points of a patch and rays from it, of which the noise is far below what is looked for.
constexpr int kDirectPoints = 256, kBounceRays = 16384;

/// The truth's radiosity [n] in lx.
std::vector<Float3> true_radiosity(const Solution& solution, const PatchComparison& compared,
                                   std::span<const Light> lights, const Sky& sky) {
  const PatchTable& table = solution.data.patches;
  std::vector<Float3> irradiance(table.size()), radiosity(table.size());
  DirectLighting(solution.data, solution.tracer, {.points_per_patch = kDirectPoints})
      .compute(lights, sky, irradiance);
  for (std::size_t k = 0; k < compared.patch.size(); ++k) {
    for (int c = 0; c < kChannelCount; ++c) {
      irradiance[compared.patch[k]][c] += compared.truth[k][c];
    }
  }
  add_reflected(table.emitted_exitance, table.reflectance, irradiance, radiosity);
  return radiosity;
}

/// The mean of what rays from the `points` of a patch meet.
glm::dvec3 trace_bounce(const DisplayMesh& mesh, const RayTracer& tracer,
                        std::span<const Float3> radiosity, std::span<const Ray> rays,
                        std::span<Hit> hits, CoincidenceScratch& scratch) {
  glm::dvec3 sum(0);
  for (std::size_t k = 0; k < rays.size(); ++k) {
    prefer_lit_side(mesh, tracer, rays[k], hits[k], scratch);
    const std::uint32_t patch = patch_at(mesh, mesh.triangle_patch, hits[k]);
    if (patch != kNone) sum += to_dvec3(radiosity[patch]);
  }
  return sum / static_cast<double>(rays.size());
}

}  // namespace

OneBounce find_one_bounce(const Solution& solution, const PatchComparison& compared,
                          std::span<const Light> lights, const Sky& sky, std::uint64_t seed) {
  const TransferData& data = solution.data;
  const RayTracer& tracer = solution.tracer;
  const std::size_t n = data.patches.size();
  const std::vector<Float3> radiosity = true_radiosity(solution, compared, lights, sky);
  OneBounce bounce;
  bounce.gathered =
      gather(*make_form_factors(SolveMethod::kConjugateGradient, data.exchange, data.patches.area),
             radiosity);
  bounce.traced.resize(n);
  const PatchTriangles triangles(data.mesh.triangle_patch, n);
#pragma omp parallel
  {
    std::vector<PatchPoint> points(kBounceRays);
    std::vector<Ray> rays(points.size());
    std::vector<Hit> hits(points.size());
    CoincidenceScratch scratch;
#pragma omp for schedule(dynamic, 16)
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t bits = mix_bits(seed ^ mix_bits(i));
      spread_points(data.mesh, triangles[i], unit_square(bits), points);
      make_hemisphere_rays(points, tracer, unit_square(bits + 1), rays);
      tracer.intersect(rays, hits);
      bounce.traced[i] = to_float3(trace_bounce(data.mesh, tracer, radiosity, rays, hits, scratch));
    }
  }
  return bounce;
}

}  // namespace rebounce::reference
