#include "precompute/patches/covers.h"

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

#include "precompute/patches/longest_edges.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce {
namespace {

using EdgeKey = ConformingMesh::EdgeKey;

// Points of a triangle at which covers are searched before it is bisected.
constexpr std::uint32_t kPoints = kMostCoverPoints;

// Points that tell whether all of a triangle is covered, beside its three corners, which are moved
// this fraction of the way to the middle.
constexpr std::uint32_t kPointsOfWhole = 12;
constexpr double kInset = 0.05;
const glm::dvec2 kTriangleCentre(1.0 / 3);

// Triangles whose longest edge is at most this number of patch sizes are fine enough.
constexpr double kFinest = 0.3;

class CoverRefinement {
 public:
  CoverRefinement(Scene& scene, std::span<const TriangleSides> sides, const RayTracer& tracer,
                  double patch_size)
      : scene_(scene), mesh_(scene), sides_(sides), tracer_(tracer), patch_size_(patch_size) {}

  void run(std::size_t most_added) {
    const std::size_t most = mesh_.triangle_count() + most_added;
    std::vector<std::uint32_t> suspects(mesh_.triangle_count());
    for (std::uint32_t t = 0; t < suspects.size(); ++t) suspects[t] = t;
    while (!suspects.empty() && mesh_.triangle_count() < most) {
      std::vector<std::uint32_t> mixed = find_mixed(suspects);
      suspects.clear();
      // The largest come first; the smallest are left if there are enough triangles.
      std::ranges::stable_sort(mixed, [this](std::uint32_t a, std::uint32_t b) {
        return longest_squared(a) > longest_squared(b);
      });
      is_new_.assign(mesh_.triangle_count(), 0);
      for (const std::uint32_t t : mixed) {
        if (is_new_[t] == 0 && mesh_.triangle_count() < most) bisect(t, suspects);
      }
    }
  }

  std::vector<std::uint32_t> finish() { return mesh_.finish(); }

 private:
  float longest_squared(std::uint32_t t) const {
    return mesh_.length_squared(longest_edge(mesh_, t));
  }

  /// Those of `suspects` that are large and covered in part.
  std::vector<std::uint32_t> find_mixed(const std::vector<std::uint32_t>& suspects) const {
    std::vector<std::uint8_t> found(suspects.size());
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t k = 0; k < suspects.size(); ++k) found[k] = is_mixed(suspects[k]) ? 1 : 0;
    std::vector<std::uint32_t> mixed;
    for (std::size_t k = 0; k < suspects.size(); ++k) {
      if (found[k] != 0) mixed.push_back(suspects[k]);
    }
    return mixed;
  }

  bool is_mixed(std::uint32_t t) const {
    const TriangleCorners front = corners_of(scene_, t);
    const double finest = kFinest * patch_size_;
    const auto length = [&](int k) { return glm::distance(front[k], front[(k + 1) % 3]); };
    if (std::max({length(0), length(1), length(2)}) <= finest) return false;
    const TriangleSides& sides = sides_[mesh_.source(t)];
    return (sides.front == SideKind::kLit && is_mixed(front)) ||
           (sides.back == SideKind::kLit && is_mixed({front[0], front[2], front[1]}));
  }

  bool is_mixed(const TriangleCorners& corners) const {
    const double part = covered_part(corners, tracer_, kCoverHeight * patch_size_, kPoints);
    return part > 0 && part < 1;
  }

  /// Bisects the longest edge of a triangle, and before it the longer edges of its neighbours; adds
  /// each new triangle to `suspects` once.
  void bisect(std::uint32_t t, std::vector<std::uint32_t>& suspects) {
    const EdgeKey wanted = longest_edge(mesh_, t);
    EdgeKey key = wanted;
    do {
      key = end_of_longest_edge_path(mesh_, wanted);
      const ConformingMesh::EdgeSplit split = mesh_.split_edge(key, 0.5);
      is_new_.resize(mesh_.triangle_count(), 0);
      for (const auto& [kept, added] : split.triangles) {
        for (const std::uint32_t part : {kept, added}) {
          if (is_new_[part] == 0) suspects.push_back(part);
          is_new_[part] = 1;
        }
      }
    } while (key != wanted);
  }

  Scene& scene_;
  ConformingMesh mesh_;
  std::span<const TriangleSides> sides_;
  const RayTracer& tracer_;
  double patch_size_;                 ///< metres
  std::vector<std::uint8_t> is_new_;  ///< of each triangle: made in this round
};

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
    some[k] = some.size() == 1 ? kTriangleCentre : square_to_triangle(r2_point(k, {0, 0}));
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
  CoverRefinement refinement(scene, sides, tracer, patch_size);
  refinement.run(most_added);
  return refinement.finish();
}

}  // namespace rebounce
