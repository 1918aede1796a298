#include "bench/truth/error_causes.h"

#include <glm/glm.hpp>

#include "precompute/patches/hit_patch.h"
#include "precompute/sampling/hemisphere_rays.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/solvers/solve_radiosity.h"
#include "transfer/base/error.h"

namespace rebounce::reference {
namespace {

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

OneBounce find_one_bounce(const TransferData& data, const RayTracer& tracer,
                          std::span<const Float3> radiosity, int ray_count, std::uint64_t seed) {
  const std::size_t n = data.patches.size();
  if (radiosity.size() != n) throw Error("one bounce: the radiosity must have one entry per patch");
  OneBounce bounce;
  bounce.gathered =
      gather(*make_form_factors(SolveMethod::kConjugateGradient, data.exchange, data.patches.area),
             radiosity);
  bounce.traced.resize(n);
  const PatchTriangles triangles(data.mesh.triangle_patch, n);
#pragma omp parallel
  {
    std::vector<PatchPoint> points(static_cast<std::size_t>(ray_count));
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
