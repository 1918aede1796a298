#include "escape.h"

#include "hemisphere_rays.h"

namespace rebounce {

Escape measure_escape(const PatchModel& model, const FlatTriangle& triangle, std::uint32_t patch,
                      const RayTracer& tracer, int ray_count, std::uint64_t seed,
                      std::vector<Ray>& rays, std::vector<Hit>& hits) {
  rays.resize(ray_count);
  hits.resize(ray_count);
  make_hemisphere_rays(triangle.vertex, triangle.normal, tracer,
                       mix_bits(seed ^ (patch * 2654435761ULL)), rays);
  tracer.intersect(rays, hits);

  int sky = 0, absorbed = 0;
  for (const Hit& hit : hits) {
    if (hit.triangle == kNone) {
      ++sky;
      continue;
    }
    // A side without a patch counts as seen: what covers it has one.
    if (!hit.front && model.mesh.back_triangle[hit.triangle] == kNone) ++absorbed;
  }
  return {static_cast<double>(sky) / ray_count, static_cast<double>(absorbed) / ray_count};
}

}  // namespace rebounce
