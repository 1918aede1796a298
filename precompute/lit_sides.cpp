#include "rebounce/precompute/lit_sides.h"

#include "float3_glm.h"
#include "rebounce/precompute/sampling.h"
#include "rebounce/runtime/ray_tracer.h"

namespace rebounce {
namespace {

// A side that sees less than about one part in this many of other surfaces counts as seeing none.
constexpr std::uint32_t kRaysPerSide = 256;

void make_rays(const Scene& scene, std::uint32_t t, bool front, std::vector<Ray>& rays) {
  const Uint3& corner = scene.triangle[t];
  const glm::dvec3 a = to_dvec3(scene.position[corner[0]]);
  const glm::dvec3 ab = to_dvec3(scene.position[corner[1]]) - a;
  const glm::dvec3 ac = to_dvec3(scene.position[corner[2]]) - a;
  const glm::dvec3 normal = glm::normalize(glm::cross(ab, ac)) * (front ? 1.0 : -1.0);
  const glm::dmat3 frame = frame_around(normal);
  const glm::dvec2 point_shift = unit_square(mix_bits(2 * t)), way_shift(unit_square(mix_bits(2 * t + 1)));
  for (std::uint32_t k = 0; k < kRaysPerSide; ++k) {
    const glm::dvec2 b = square_to_triangle(r2_point(k, point_shift));
    // A second sequence with other steps, so that points and directions do not march together.
    const glm::dvec2 s = glm::fract(way_shift + (k + 0.5) * glm::dvec2(0.41421356, 0.73205081));
    Ray& ray = rays[k];
    ray = Ray{};
    ray.origin = offset_point(to_float3(a + b.x * ab + b.y * ac), to_float3(normal));
    ray.direction = to_float3(frame * square_to_cosine_hemisphere(s));
    ray.t_near = 0;
    ray.t_far = std::numeric_limits<float>::infinity();
  }
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
    make_rays(scene, t, front, rays);
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
