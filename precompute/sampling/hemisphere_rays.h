#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/sampling.h"

namespace rebounce {

/// Sine and cosine of an angle of at most pi / 4 by their series, to the precision of a float.
inline float small_sine(float angle) {
  const float a = angle * angle;
  return angle *
         (1 + a * (-1.0F / 6 + a * (1.0F / 120 + a * (-1.0F / 5040 + a * (1.0F / 362880)))));
}
inline float small_cosine(float angle) {
  const float a = angle * angle;
  return 1 + a * (-0.5F + a * (1.0F / 24 + a * (-1.0F / 720 + a * (1.0F / 40320))));
}

/// Samples of directions, in [0, 1)². The irrational steps differ from those of r2_sequence, so
/// that points and directions are not correlated.
inline PointSequence direction_sequence(const glm::dvec2& shift) {
  return {shift, {0.41421356237, 0.73205080757}};
}

/// square_to_cosine_hemisphere in single precision, for many calls.
inline glm::vec3 to_cosine_direction(const glm::dvec2& s) {
  const float x = static_cast<float>(2 * s.x - 1), y = static_cast<float>(2 * s.y - 1);
  const bool wide = std::abs(x) > std::abs(y);
  const float r = wide ? x : y, across = wide ? y : x;
  const float angle = r == 0 ? 0 : std::numbers::pi_v<float> / 4 * (across / r);
  const float along = r * small_cosine(angle), aside = r * small_sine(angle);
  return {wide ? along : aside, wide ? aside : along, std::sqrt(std::max(0.0F, 1 - r * r))};
}

/// Turns directions around +Z to directions around `normal`. The frame is kept as long as the
/// normal stays the same.
class NormalFrame {
 public:
  glm::vec3 turn(const Float3& normal, const glm::vec3& direction) {
    if (normal != normal_) {
      normal_ = normal;
      frame_ = glm::mat3(frame_around(to_dvec3(normal)));
    }
    return frame_ * direction;
  }

 private:
  Float3 normal_{0, 0, 1};
  glm::mat3 frame_{1};
};

/// A ray without end from `point` along the unit vector `direction`.
inline Ray make_free_ray(const PatchPoint& point, const glm::vec3& direction,
                         const RayTracer& tracer) {
  Ray ray{};
  ray.origin = tracer.offset_point(point.position, point.normal);
  ray.direction = to_float3(direction);
  ray.t_near = 0;
  ray.t_far = std::numeric_limits<float>::infinity();
  return ray;
}

/// Fills `rays` with one cosine-distributed ray from each of `points`. The directions are those of
/// a low-discrepancy sequence shifted by `direction_shift`.
inline void make_hemisphere_rays(std::span<const PatchPoint> points, const RayTracer& tracer,
                                 const glm::dvec2& direction_shift, std::span<Ray> rays) {
  const PointSequence directions = direction_sequence(direction_shift);
  NormalFrame frame;
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    rays[k] = make_free_ray(
        points[k], frame.turn(points[k].normal, to_cosine_direction(directions[k])), tracer);
  }
}

/// Fills `rays` with cosine-distributed rays from points spread over a triangle, on the side that
/// `normal` points to: the rays with numbers from `first` on. The same `seed` gives the same rays.
inline void make_hemisphere_rays(const std::array<glm::dvec3, 3>& triangle,
                                 const glm::dvec3& normal, const RayTracer& tracer,
                                 std::uint64_t seed, std::span<Ray> rays, std::uint32_t first = 0) {
  const glm::dvec2 point_shift = unit_square(mix_bits(seed));
  const glm::dvec2 direction_shift = unit_square(mix_bits(seed + 1));
  const PointSequence points = r2_sequence(point_shift);
  const PointSequence directions = direction_sequence(direction_shift);
  NormalFrame frame;
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    const glm::dvec2 b = square_to_triangle(points[first + k]);
    const glm::dvec3 origin = (1 - b.x - b.y) * triangle[0] + b.x * triangle[1] + b.y * triangle[2];
    const PatchPoint point{to_float3(origin), to_float3(normal)};
    rays[k] = make_free_ray(
        point, frame.turn(point.normal, to_cosine_direction(directions[first + k])), tracer);
  }
}

}  // namespace rebounce
