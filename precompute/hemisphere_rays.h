#pragma once

#include <array>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/patch_points.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {

/// Fills `rays` with cosine-distributed rays, one from each of `points`; the directions are those
/// of a low-discrepancy sequence shifted by `direction_shift`.
inline void make_hemisphere_rays(std::span<const PatchPoint> points, const RayTracer& tracer,
                                 const glm::dvec2& direction_shift, std::span<Ray> rays) {
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    const auto& [position, normal] = points[k];
    // Other irrational steps than those of r2_point, so that points and directions do not march
    // together.
    const glm::dvec2 s =
        glm::fract(direction_shift + (k + 0.5) * glm::dvec2(0.41421356237, 0.73205080757));
    rays[k] = Ray{};
    rays[k].origin = tracer.offset_point(position, normal);
    rays[k].direction = to_float3(frame_around(to_dvec3(normal)) * square_to_cosine_hemisphere(s));
    rays[k].t_near = 0;
    rays[k].t_far = std::numeric_limits<float>::infinity();
  }
}

/// Fills `rays` with cosine-distributed rays from points spread over a triangle, on the side that
/// `normal` points to. The same `seed` gives the same rays.
inline void make_hemisphere_rays(const std::array<glm::dvec3, 3>& triangle,
                                 const glm::dvec3& normal, const RayTracer& tracer,
                                 std::uint64_t seed, std::span<Ray> rays) {
  const glm::dvec2 point_shift = unit_square(mix_bits(seed));
  std::vector<PatchPoint> points(rays.size());
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    const glm::dvec2 b = square_to_triangle(r2_point(k, point_shift));
    const glm::dvec3 origin = (1 - b.x - b.y) * triangle[0] + b.x * triangle[1] + b.y * triangle[2];
    points[k] = {to_float3(origin), to_float3(normal)};
  }
  make_hemisphere_rays(points, tracer, unit_square(mix_bits(seed + 1)), rays);
}

}  // namespace rebounce
