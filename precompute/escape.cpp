#include "escape.h"

#include <array>

#include "hemisphere_rays.h"
#include "rebounce/runtime/float3_glm.h"
#include "rebounce/transfer/sky_cells.h"
#include "seen_patch.h"

namespace rebounce {
namespace {

/// If `hit` of `ray` is a side without a patch of its own, in whose place another one has one and
/// faces the same way, makes that one the side that was hit. The weights of the vertices are left.
void prefer_lit_side(const PatchModel& model, const RayTracer& tracer, const Ray& ray, Hit& hit,
                     EscapeScratch& scratch) {
  const DisplayMesh& mesh = model.mesh;
  const auto corner = [&](int k) {
    return to_dvec3(mesh.position[mesh.triangle[hit.triangle][k]]);
  };
  const glm::dvec3 normal =
      glm::normalize(glm::cross(corner(1) - corner(0), corner(2) - corner(0)));
  const glm::dvec3 point =
      to_dvec3(ray.origin) + static_cast<double>(hit.t) * to_dvec3(ray.direction);
  find_coincident_sides(
      tracer, to_float3(point), to_float3(hit.front ? normal : -normal), hit.triangle,
      [&](std::uint32_t t) { return mesh.back_triangle[t] != kNone; }, scratch.near_hits,
      scratch.sides);
  std::uint32_t least = kNone;
  for (const CoincidentSide& side : scratch.sides) {
    const std::uint32_t shown = side.front ? side.triangle : mesh.back_triangle[side.triangle];
    if (!side.same_way || mesh.triangle_patch[shown] >= least) continue;
    least = mesh.triangle_patch[shown];
    hit.triangle = side.triangle;
    hit.front = side.front;
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
  std::array<int, kSkyCellCount> count{};
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    Hit& hit = scratch.hits[k];
    if (hit.triangle != kNone && seen_patch(model.mesh, hit) == kNone) {
      prefer_lit_side(model, tracer, scratch.rays[k], hit, scratch);
    }
    if (hit.triangle == kNone) {
      ++sky;
      ++count[sky_cell(scratch.rays[k].direction)];
    } else if (patch_at(model, hit) == kNone) {
      ++absorbed;
    }
  }
  Escape escape{static_cast<double>(sky) / ray_count, static_cast<double>(absorbed) / ray_count};
  for (std::uint32_t cell = 0; sky > 0 && cell < kSkyCellCount; ++cell) {
    if (count[cell] == 0) continue;
    escape.sky_cells.emplace_back(static_cast<std::uint8_t>(cell),
                                  static_cast<float>(count[cell]) / static_cast<float>(ray_count));
  }
  return escape;
}

std::uint32_t patch_at(const PatchModel& model, const Hit& hit) {
  if (meets_back(model.mesh, hit)) return kNone;
  return model.shown_patch[hit.front ? hit.triangle : model.mesh.back_triangle[hit.triangle]];
}

}  // namespace rebounce
