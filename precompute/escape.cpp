#include "escape.h"

#include "hemisphere_rays.h"

#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

/// If `hit` of `ray` is the back of a one-sided triangle in whose place another one shows its
/// front, makes that one the triangle that was hit. The weights of the vertices are left.
void prefer_front(const PatchModel& model, const RayTracer& tracer, const Ray& ray, Hit& hit,
                  EscapeScratch& scratch) {
  const DisplayMesh& mesh = model.mesh;
  const auto corner = [&](int k) { return to_dvec3(mesh.position[mesh.triangle[hit.triangle][k]]); };
  const glm::dvec3 normal =
      -glm::normalize(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
  const glm::dvec3 point = to_dvec3(ray.origin) + static_cast<double>(hit.t) * to_dvec3(ray.direction);
  find_coincident_sides(
      tracer, to_float3(point), to_float3(normal), hit.triangle,
      [&](std::uint32_t t) { return mesh.back_triangle[t] != kNone; }, scratch.near_hits,
      scratch.sides);
  for (const CoincidentSide& side : scratch.sides) {
    if (!side.same_way) continue;
    hit.triangle = side.triangle;
    hit.front = side.front;
    return;
  }
}

}  // namespace

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
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    Hit& hit = scratch.hits[k];
    const bool is_back = hit.triangle != kNone && !hit.front;
    if (is_back && patch_at(model, hit) == kNone) {
      prefer_front(model, tracer, scratch.rays[k], hit, scratch);
    }
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
