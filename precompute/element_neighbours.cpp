#include "element_neighbours.h"

#include <algorithm>
#include <array>
#include <compare>

#include "point_finder.h"
#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

struct DirectedEdge {
  std::uint32_t low, high;  ///< positions
  bool ascends;             ///< runs from low to high
  std::uint32_t element;

  auto operator<=>(const DirectedEdge&) const = default;
};

std::vector<DirectedEdge> sorted_edges(std::span<const Uint3> corner) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * corner.size());
  for (std::uint32_t e = 0; e < corner.size(); ++e) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = corner[e][k], b = corner[e][(k + 1) % 3];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), a < b, e});
    }
  }
  std::ranges::sort(edges);
  return edges;
}

/// The two sides of one triangle.
bool are_two_sides(const Uint3& a, const Uint3& b) {
  Uint3 x = a, y = b;
  std::ranges::sort(x);
  std::ranges::sort(y);
  return x == y;
}

void sort_and_unique(Pairs& pairs) {
  std::ranges::sort(pairs);
  pairs.erase(std::ranges::unique(pairs).begin(), pairs.end());
}

// How far lines of sight are lifted off the surface, as a part of their length: half a circle's
// rounding is passed over, a wall is not.
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
  const std::vector<DirectedEdge> edges = sorted_edges(corner);
  Pairs pairs;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low &&
           edges[end].high == edges[begin].high) {
      ++end;
    }
    // Sorted: those that descend come first.
    for (std::size_t i = begin; i < end && !edges[i].ascends; ++i) {
      for (std::size_t j = end; j-- > i + 1 && edges[j].ascends;) {
        const auto [a, b] = std::minmax(edges[i].element, edges[j].element);
        if (a != b && !are_two_sides(corner[a], corner[b])) pairs.emplace_back(a, b);
      }
    }
  }
  sort_and_unique(pairs);
  return pairs;
}

Pairs find_near_pairs(std::span<const Float3> point, std::size_t count, float reach) {
  if (point.size() < 2) return {};
  const PointFinder finder(point);
  std::vector<std::vector<PointFinder::Found>> found(point.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t k = 0; k < point.size(); ++k) {
    found[k] = finder.nearest(point[k], count + 1);  // a point is its own nearest
  }
  Pairs pairs;
  for (std::uint32_t k = 0; k < point.size(); ++k) {
    for (const auto& [other, distance_squared] : found[k]) {
      if (other == k || distance_squared > reach * reach) continue;
      pairs.emplace_back(std::min(k, other), std::max(k, other));
    }
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
