#include "rebounce/precompute/lit_sides.h"

#include "hemisphere_rays.h"
#include "rebounce/runtime/ray_tracer.h"

namespace rebounce {
namespace {

// A side that sees less than about one part in this many of other surfaces counts as seeing none.
constexpr std::uint32_t kRaysPerSide = 256;

void make_rays(const Scene& scene, const RayTracer& tracer, std::uint32_t t, bool front,
               std::vector<Ray>& rays) {
  const Uint3& corner = scene.triangle[t];
  const glm::dvec3 a = to_dvec3(scene.position[corner[0]]), b = to_dvec3(scene.position[corner[1]]),
                   c = to_dvec3(scene.position[corner[2]]);
  const glm::dvec3 normal = glm::normalize(glm::cross(b - a, c - a)) * (front ? 1.0 : -1.0);
  make_hemisphere_rays({a, b, c}, normal, tracer, mix_bits(t), rays);
}

}  // namespace

std::vector<std::uint8_t> find_lit_sides(const Scene& scene) {
  std::vector<std::uint8_t> sides(scene.triangle.size(), kFrontSide);
  const RayTracer tracer(scene.position, scene.triangle);
  const auto is_double_sided = [&](std::uint32_t t) {
    return scene.materials[scene.triangle_material[t]].double_sided;
  };
  const auto sees_a_surface = [&](std::uint32_t t, bool front, std::vector<Ray>& rays,
                                  std::vector<Hit>& hits) {
    make_rays(scene, tracer, t, front, rays);
    tracer.intersect(rays, hits);
    for (const Hit& hit : hits) {
      if (hit.triangle != kNone && (hit.front || is_double_sided(hit.triangle))) return true;
    }
    return false;
  };

#pragma omp parallel
  {
    std::vector<Ray> rays(kRaysPerSide);
    std::vector<Hit> hits(kRaysPerSide);
#pragma omp for schedule(dynamic, 16)
    for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
      if (!is_double_sided(t)) continue;
      const bool front = sees_a_surface(t, true, rays, hits);
      const bool back = sees_a_surface(t, false, rays, hits);
      sides[t] = back ? (front ? kBothSides : kBackSide) : kFrontSide;
    }
  }
  return sides;
}

}  // namespace rebounce
