#include "precompute/patches/covers.h"

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

#include "precompute/patches/refinement.h"
#include "precompute/patches/triangle_points.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

// Points of a triangle at which covers are searched before it is bisected.
constexpr std::uint32_t kPoints = kMostCoverPoints;

// Points that tell whether all of a triangle is covered, beside its three corners, which are moved
// this fraction of the way to the middle.
constexpr std::uint32_t kPointsOfWhole = 12;
constexpr double kInset = 0.05;

// Triangles whose longest edge is at most this number of patch sizes are fine enough.
constexpr double kFinest = 0.3;

/// The number of points of the front of a triangle that have a surface within `height` metres above
/// them; 0 for a triangle without area, which cuts may leave.
std::size_t count_covered(const TriangleCorners& corners, std::span<const glm::dvec2> points,
                          const RayTracer& tracer, double height) {
  if (area_vector(corners) == glm::dvec3(0)) return 0;
  const glm::dvec3 up = front_normal(corners);
  std::array<Ray, kMostCoverPoints> room;
  const std::span<Ray> rays = std::span(room).first(points.size());
  for (std::size_t k = 0; k < rays.size(); ++k) {
    Ray& ray = rays[k] = Ray{};
    ray.origin = tracer.offset_point(to_float3(point_at(corners, points[k])), to_float3(up));
    ray.direction = to_float3(up);
    ray.t_near = 0;
    ray.t_far = static_cast<float>(height);
  }
  tracer.occluded(rays);
  return static_cast<std::size_t>(std::ranges::count_if(rays, is_occluded));
}

}  // namespace

double covered_part(const TriangleCorners& corners, const RayTracer& tracer, double height,
                    std::uint32_t count) {
  std::array<glm::dvec2, kMostCoverPoints> points;
  const auto some = std::span(points).first(std::min(count, kMostCoverPoints));
  for (std::uint32_t k = 0; k < some.size(); ++k) {
    some[k] = triangle_point(k, static_cast<std::uint32_t>(some.size()));
  }
  return static_cast<double>(count_covered(corners, some, tracer, height)) /
         static_cast<double>(some.size());
}

bool is_covered(const TriangleCorners& corners, const RayTracer& tracer, double height) {
  std::array<glm::dvec2, 3> tips = {glm::dvec2(0, 0), {1, 0}, {0, 1}};
  for (glm::dvec2& tip : tips) tip = glm::mix(tip, kTriangleCentre, kInset);
  return count_covered(corners, tips, tracer, height) == tips.size() &&
         covered_part(corners, tracer, height, kPointsOfWhole) == 1;
}

std::vector<std::uint32_t> refine_at_covers(Scene& scene, std::span<const TriangleSides> sides,
                                            const RayTracer& tracer, double patch_size,
                                            std::size_t most_added) {
  const auto is_mixed = [&](const TriangleCorners& corners) {
    const double part = covered_part(corners, tracer, kCoverHeight * patch_size, kPoints);
    return part > 0 && part < 1;
  };
  const auto is_coarse = [&](const TriangleCorners& front, std::uint32_t source) {
    if (longest_edge_length(front) <= kFinest * patch_size) return false;
    return (sides[source].front == SideKind::kLit && is_mixed(front)) ||
           (sides[source].back == SideKind::kLit && is_mixed({front[0], front[2], front[1]}));
  };
  return refine_where(scene, is_coarse, most_added);
}

}  // namespace rebounce
