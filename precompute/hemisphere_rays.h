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

/// Sample k of directions, in [0, 1)². Its steps are other irrational ones than those of r2_point,
/// so that points and directions do not march together.
inline glm::dvec2 direction_sample(const glm::dvec2& shift, std::uint32_t k) {
  return glm::fract(shift + (k + 0.5) * glm::dvec2(0.41421356237, 0.73205080757));
}

/// Cosine-distributed ray k from `point`; the directions are those of a low-discrepancy sequence
/// shifted by `direction_shift`.
inline Ray make_hemisphere_ray(const PatchPoint& point, const RayTracer& tracer,
                               const glm::dvec2& direction_shift, std::uint32_t k) {
  const glm::dvec2 s = direction_sample(direction_shift, k);
  Ray ray{};
  ray.origin = tracer.offset_point(point.position, point.normal);
  ray.direction = to_float3(frame_around(to_dvec3(point.normal)) * square_to_cosine_hemisphere(s));
  ray.t_near = 0;
  ray.t_far = std::numeric_limits<float>::infinity();
  return ray;
}

/// Fills `rays` with one such ray from each of `points`.
inline void make_hemisphere_rays(std::span<const PatchPoint> points, const RayTracer& tracer,
                                 const glm::dvec2& direction_shift, std::span<Ray> rays) {
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    rays[k] = make_hemisphere_ray(points[k], tracer, direction_shift, k);
  }
}

/// Fills `rays` with such rays, from number `first` on, from points spread over a triangle, on the
/// side that `normal` points to. The same `seed` gives the same rays.
inline void make_hemisphere_rays(const std::array<glm::dvec3, 3>& triangle,
                                 const glm::dvec3& normal, const RayTracer& tracer,
                                 std::uint64_t seed, std::span<Ray> rays, std::uint32_t first = 0) {
  const glm::dvec2 point_shift = unit_square(mix_bits(seed));
  const glm::dvec2 direction_shift = unit_square(mix_bits(seed + 1));
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    const glm::dvec2 b = square_to_triangle(r2_point(first + k, point_shift));
    const glm::dvec3 origin = (1 - b.x - b.y) * triangle[0] + b.x * triangle[1] + b.y * triangle[2];
    rays[k] = make_hemisphere_ray({to_float3(origin), to_float3(normal)}, tracer, direction_shift,
                                  first + k);
  }
}

}  // namespace rebounce
