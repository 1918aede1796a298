#include "precompute/patches/hit_patch.h"

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

std::uint32_t side_of(const DisplayMesh& mesh, std::uint32_t triangle, bool front) {
  return front ? triangle : mesh.back_triangle[triangle];
}

/// Unit, on the side that was hit.
glm::dvec3 normal_at(const DisplayMesh& mesh, const Hit& hit) {
  const glm::dvec3 normal = front_normal(corners_of(mesh, hit.triangle));
  return hit.front ? normal : -normal;
}

}  // namespace

void find_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray, Hit& hit,
                   CoincidenceScratch& scratch) {
  const glm::dvec3 point =
      to_dvec3(ray.origin) + static_cast<double>(hit.t) * to_dvec3(ray.direction);
  find_coincident_sides(
      tracer, to_float3(point), to_float3(normal_at(mesh, hit)), hit.triangle,
      [&](std::uint32_t t) { return mesh.back_triangle[t] != kNone; }, scratch.hits, scratch.sides);
  std::uint32_t least = kNone;
  for (const CoincidentSide& side : scratch.sides) {
    const std::uint32_t shown = side_of(mesh, side.triangle, side.front);
    if (!side.same_way || mesh.triangle_patch[shown] >= least) continue;
    least = mesh.triangle_patch[shown];
    hit.triangle = side.triangle;
    hit.front = side.front;
  }
}

}  // namespace rebounce
