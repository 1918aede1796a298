#pragma once

#include <array>
#include <glm/glm.hpp>
#include <limits>
#include <span>

#include "rebounce/runtime/float3_glm.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/runtime/sampling.h"

namespace rebounce {

/// Fills `rays` with cosine-distributed rays from points spread over a triangle, on the side that
/// `normal` points to. The same `seed` gives the same rays.
inline void make_hemisphere_rays(const std::array<glm::dvec3, 3>& triangle,
                                 const glm::dvec3& normal, const RayTracer& tracer,
                                 std::uint64_t seed, std::span<Ray> rays) {
  const glm::dmat3 frame = frame_around(normal);
  const glm::dvec2 point_shift = unit_square(mix_bits(seed));
  const glm::dvec2 direction_shift = unit_square(mix_bits(seed + 1));
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    const glm::dvec2 b = square_to_triangle(r2_point(k, point_shift));
    // Other irrational steps than the points', so that the two do not march together.
    const glm::dvec2 s =
        glm::fract(direction_shift + (k + 0.5) * glm::dvec2(0.41421356237, 0.73205080757));
    const glm::dvec3 origin = (1 - b.x - b.y) * triangle[0] + b.x * triangle[1] + b.y * triangle[2];
    rays[k] = Ray{};
    rays[k].origin = tracer.offset_point(to_float3(origin), to_float3(normal));
    rays[k].direction = to_float3(frame * square_to_cosine_hemisphere(s));
    rays[k].t_near = 0;
    rays[k].t_far = std::numeric_limits<float>::infinity();
  }
}

}  // namespace rebounce
