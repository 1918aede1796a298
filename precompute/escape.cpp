#include "escape.h"

#include "hemisphere_rays.h"

namespace rebounce {

Escape measure_escape(const PatchModel& model, std::span<const std::uint32_t> triangles,
                      std::uint32_t patch, const RayTracer& tracer, int ray_count,
                      std::uint64_t seed, EscapeScratch& scratch) {
  scratch.points.resize(ray_count);
  scratch.rays.resize(ray_count);
  scratch.hits.resize(ray_count);
  const std::uint64_t bits = mix_bits(seed ^ (patch * 2654435761ULL));
  spread_points(model.mesh, triangles, unit_square(mix_bits(bits)), scratch.points);
  make_hemisphere_rays(scratch.points, tracer, unit_square(mix_bits(bits + 1)), scratch.rays);
  tracer.intersect(scratch.rays, scratch.hits);

  int sky = 0, absorbed = 0;
  for (const Hit& hit : scratch.hits) {
    if (hit.triangle == kNone) {
      ++sky;
    } else if (patch_at(model, hit) == kNone) {
      ++absorbed;
    }
  }
  return {static_cast<double>(sky) / ray_count, static_cast<double>(absorbed) / ray_count};
}

std::uint32_t patch_at(const PatchModel& model, const Hit& hit) {
  const std::uint32_t side = hit.front ? hit.triangle : model.mesh.back_triangle[hit.triangle];
  return side == kNone ? kNone : model.shown_patch[side];
}

}  // namespace rebounce
