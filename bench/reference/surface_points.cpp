#include "bench/reference/surface_points.h"

#include "bench/reference/scene_surface.h"
#include "rebounce/error.h"
#include "runtime/rays/cumulative_choice.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce::reference {
namespace {

SurfacePoint point_on(const SceneSurface& surface, std::uint32_t triangle, bool front,
                      const glm::dvec2& barycentric) {
  const TriangleCorners corners = surface.corners(triangle);
  return {.position = to_float3(point_at(corners, barycentric)),
          .normal = to_float3(front_normal(corners) * (front ? 1.0 : -1.0)),
          .triangle = triangle,
          .barycentric = {static_cast<float>(barycentric.x), static_cast<float>(barycentric.y)}};
}

}  // namespace

std::vector<SurfacePoint> sample_surface(const Scene& scene, std::span<const TriangleSides> sides,
                                         std::size_t count, std::uint64_t seed) {
  if (sides.size() != scene.triangle.size()) {
    throw Error("points on " + scene.name + ": one entry of sides per triangle is needed");
  }
  const SceneSurface surface(scene);
  CumulativeChoice choice;  // front and back of each triangle
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    const double area = area_of(surface.corners(t));
    choice.add(sides[t].front == SideKind::kLit ? area : 0);
    choice.add(sides[t].back == SideKind::kLit ? area : 0);
  }
  if (!(choice.total() > 0) || !std::isfinite(choice.total())) {
    throw Error("points on " + scene.name + ": it has no surface to put them on");
  }
  std::vector<SurfacePoint> points;
  points.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint64_t bits = mix_bits(seed ^ mix_bits(k));
    const double jitter = unit_square(bits).x;
    const auto side =
        choice.choose((static_cast<double>(k) + jitter) / static_cast<double>(count)).index;
    points.push_back(point_on(surface, static_cast<std::uint32_t>(side / 2), side % 2 == 0,
                              square_to_triangle(unit_square(mix_bits(bits)))));
  }
  return points;
}

}  // namespace rebounce::reference
