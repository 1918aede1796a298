#include "precompute/patches/element_neighbours.h"

#include <algorithm>
#include <array>

#include "precompute/base/edge_table.h"
#include "precompute/sampling/point_finder.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

/// True for the two sides of one triangle.
bool are_two_sides(const Uint3& a, const Uint3& b) {
  Uint3 x = a, y = b;
  std::ranges::sort(x);
  std::ranges::sort(y);
  return x == y;
}

void sort_and_unique(Pairs& pairs) {
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

// The height of lines of sight above the surface, as a fraction of their length: they pass over the
// curvature of half a circle, but not over a wall.
constexpr float kLift = 0.3F;

Ray segment(const glm::vec3& from, const glm::vec3& to) {
  Ray ray{};
  ray.origin = to_float3(from);
  ray.direction = to_float3(to - from);
  ray.t_near = 0;
  ray.t_far = 1;
  return ray;
}

}  // namespace

Pairs find_edge_neighbours(std::span<const Uint3> corner) {
  std::uint32_t end_count = 0;
  for (const Uint3& ends : corner) end_count = std::max(end_count, 1 + std::ranges::max(ends));
  const EdgeTable edges(corner.size(), end_count, [&](std::uint32_t e) { return corner[e]; });
  Pairs pairs;
  edges.for_each([&](std::uint32_t /*low*/, std::span<const HalfEdge> sides) {
    for (std::size_t i = 0; i < sides.size(); ++i) {
      for (std::size_t j = i + 1; j < sides.size(); ++j) {
        const std::uint32_t a = sides[i].triangle(), b = sides[j].triangle();
        if (sides[i].ascends() == sides[j].ascends() || are_two_sides(corner[a], corner[b]))
          continue;
        pairs.emplace_back(std::min(a, b), std::max(a, b));
      }
    }
  });
  sort_and_unique(pairs);
  return pairs;
}

Pairs find_near_pairs(std::span<const Float3> point, std::size_t count, float reach) {
  if (point.size() < 2) return {};
  const PointFinder finder(point);
  std::vector<std::uint32_t> near(count * point.size(), kNone);
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t k = 0; k < point.size(); ++k) {
    std::size_t place = count * k;
    for (const auto& [other, distance_squared] : finder.nearest(point[k], count + 1)) {
      const bool wanted = other != k && distance_squared <= reach * reach;
      if (wanted && place < count * (k + 1)) near[place++] = other;
    }
  }
  Pairs pairs;
  for (std::size_t place = 0; place < near.size(); ++place) {
    const auto k = static_cast<std::uint32_t>(place / count);
    if (near[place] != kNone)
      pairs.emplace_back(std::min(k, near[place]), std::max(k, near[place]));
  }
  sort_and_unique(pairs);
  return pairs;
}

std::array<Ray, 3> line_of_sight(const PatchPoint& a, const PatchPoint& b,
                                 const RayTracer& tracer) {
  const glm::vec3 pa = to_glm(tracer.offset_point(a.position, a.normal));
  const glm::vec3 pb = to_glm(tracer.offset_point(b.position, b.normal));
  const float lift = kLift * glm::distance(pa, pb);
  const glm::vec3 above_a = pa + lift * to_glm(a.normal), above_b = pb + lift * to_glm(b.normal);
  return {segment(above_a, above_b), segment(pa, above_a), segment(pb, above_b)};
}

std::uint32_t find_between(const PatchPoint& a, const PatchPoint& b, const RayTracer& tracer) {
  const std::array<Ray, 3> rays = line_of_sight(a, b, tracer);
  std::array<Hit, 3> hits;
  tracer.intersect(rays, hits);
  const auto hit = std::ranges::find_if(hits, [](const Hit& h) { return h.triangle != kNone; });
  return hit == hits.end() ? kNone : hit->triangle;
}

}  // namespace rebounce
