#include "bench/reference/scene_key_light.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "bench/reference/scene_surface.h"
#include "runtime/rays/box.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce::reference {
namespace {

constexpr double kFluxPerArea = 100;  // lm/m²
constexpr std::size_t kCandidates = 128;
constexpr std::size_t kReceivers = 512;  // points that a candidate may reach
constexpr std::uint32_t kClearanceRays = 64;

// A receiver is inside of the scene if at least half of so many rays from it meet something: what
// reaches an outer wall goes nowhere from there.
constexpr std::uint32_t kInsideRays = 16;

// A lamp counts as close to a surface within this part of the scene's diagonal.
constexpr double kCloseness = 0.08;

double lit_area(const Scene& scene, std::span<const TriangleSides> sides) {
  const SceneSurface surface(scene);
  double area = 0;
  for (std::uint32_t t = 0; t < sides.size(); ++t) {
    area += area_of(surface.corners(t)) * sides[t].patch_count();
  }
  return area;
}

Ray make_ray(const Float3& origin, const Float3& direction, float t_far) {
  Ray ray{};
  ray.origin = origin;
  ray.direction = direction;
  ray.t_near = 0;
  ray.t_far = t_far;
  return ray;
}

/// A place half way from each point to what a random ray from there meets, or up to `reach`.
std::vector<Float3> make_candidates(std::span<const SurfacePoint> points, const RayTracer& tracer,
                                    double reach, std::uint64_t seed) {
  std::vector<Ray> rays;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const glm::dvec3 local = square_to_cosine_hemisphere(unit_square(mix_bits(seed ^ mix_bits(k))));
    const glm::dvec3 direction = frame_around(to_dvec3(points[k].normal)) * local;
    rays.push_back(make_ray(tracer.offset_point(points[k].position, points[k].normal),
                            to_float3(direction), static_cast<float>(reach)));
  }
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  std::vector<Float3> places;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const double way = hits[k].triangle == kNone ? reach : hits[k].t;
    places.push_back(to_float3(to_dvec3(rays[k].origin) + 0.5 * way * to_dvec3(rays[k].direction)));
  }
  return places;
}

/// Those of `points` that are inside of the scene; all of them if none is.
std::vector<SurfacePoint> those_inside(std::vector<SurfacePoint> points, const RayTracer& tracer) {
  const auto is_outside = [&](const SurfacePoint& point) {
    std::vector<Ray> rays;
    for (std::uint32_t k = 0; k < kInsideRays; ++k) {
      const glm::dvec3 local = square_to_cosine_hemisphere(r2_point(k, glm::dvec2(0)));
      rays.push_back(make_ray(tracer.offset_point(point.position, point.normal),
                              to_float3(frame_around(to_dvec3(point.normal)) * local),
                              std::numeric_limits<float>::infinity()));
    }
    tracer.occluded(rays);
    return 2 * std::ranges::count_if(rays, is_occluded) < static_cast<std::ptrdiff_t>(rays.size());
  };
  std::vector<SurfacePoint> inside = points;
  std::erase_if(inside, is_outside);
  if (inside.empty()) return points;
  return inside;
}

/// The part of `receivers` that face `place` with nothing between.
double reached_part(const Float3& place, std::span<const SurfacePoint> receivers,
                    const RayTracer& tracer) {
  std::vector<Ray> rays;
  for (const SurfacePoint& r : receivers) {
    const Float3 origin = tracer.offset_point(r.position, r.normal);
    const glm::dvec3 way = to_dvec3(place) - to_dvec3(origin);
    if (glm::dot(way, to_dvec3(r.normal)) <= 0) continue;
    rays.push_back(make_ray(origin, to_float3(way), 1));
  }
  tracer.occluded(rays);
  const auto reached =
      std::count_if(rays.begin(), rays.end(), [](const Ray& ray) { return !is_occluded(ray); });
  return static_cast<double>(reached) / static_cast<double>(receivers.size());
}

/// The distance of `place` to the nearest surface around it, `reach` at most.
double clearance(const Float3& place, const RayTracer& tracer, double reach) {
  std::vector<Ray> rays;
  for (std::uint32_t k = 0; k < kClearanceRays; ++k) {
    const glm::dvec2 s = r2_point(k, glm::dvec2(0));
    const double z = 2 * s.x - 1, r = std::sqrt(1 - z * z), phi = 2 * std::numbers::pi * s.y;
    rays.push_back(make_ray(place, to_float3(glm::dvec3(r * std::cos(phi), r * std::sin(phi), z)),
                            static_cast<float>(reach)));
  }
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  for (const Hit& hit : hits) {
    if (hit.triangle != kNone) reach = std::min(reach, static_cast<double>(hit.t));
  }
  return reach;
}

}  // namespace

Light make_key_light(const Scene& scene, const RayTracer& tracer,
                     std::span<const TriangleSides> sides, std::uint64_t seed) {
  const double size = box_around(scene.position).diagonal();
  const auto receivers = those_inside(sample_surface(scene, sides, kReceivers, seed), tracer);
  const auto candidates = make_candidates(sample_surface(scene, sides, kCandidates, seed + 1),
                                          tracer, 0.5 * size, seed);
  Light light;
  light.name = "key light";
  light.intensity =
      static_cast<float>(kFluxPerArea * lit_area(scene, sides) / (4 * std::numbers::pi));
  double best = -1;
  for (const Float3& place : candidates) {
    const double merit =
        reached_part(place, receivers, tracer) * clearance(place, tracer, kCloseness * size);
    if (merit <= best) continue;
    best = merit;
    light.position = place;
  }
  return light;
}

}  // namespace rebounce::reference
