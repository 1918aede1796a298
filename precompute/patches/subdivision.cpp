#include "precompute/patches/subdivision.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <queue>
#include <unordered_set>

#include "precompute/patches/conforming_mesh.h"
#include "precompute/patches/longest_edges.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"

namespace rebounce {
namespace {

using EdgeKey = ConformingMesh::EdgeKey;

struct QueuedEdge {
  float length_squared;
  EdgeKey key;
  bool operator<(const QueuedEdge& other) const {
    if (length_squared != other.length_squared) return length_squared < other.length_squared;
    return key > other.key;
  }
};

class Subdivision {
 public:
  Subdivision(Scene& scene, std::span<const std::uint8_t> patches_per_triangle,
              const SubdivisionSettings& settings, std::span<const float> density_weight)
      : mesh_(scene),
        patches_per_triangle_(patches_per_triangle),
        settings_(settings),
        density_weight_(density_weight) {
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      patch_count_ += patches_per_triangle[t];
    }
    longest_ = kLongestEdge * important_patch_size(scene);
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      for (int corner = 0; corner < 3; ++corner) {
        const Uint3& v = scene.triangle[t];
        const glm::vec3 side =
            to_glm(scene.position[v[corner]]) - to_glm(scene.position[v[(corner + 1) % 3]]);
        if (is_short(glm::dot(side, side))) continue;  // the least length that can still count
        const EdgeKey key = mesh_.edge(t, corner);
        if (mesh_.triangles(key).front().triangle() == t) enqueue(key);
      }
    }
  }

  void run() {
    while (!queue_.empty() && !is_short(queue_.top().length_squared)) {
      const EdgeKey wanted = queue_.top().key;
      if (split_before_.contains(wanted)) {
        queue_.pop();
        continue;
      }
      const EdgeKey longest =
          density_weight_.empty() ? wanted : end_of_longest_edge_path(mesh_, wanted);
      if (longest == wanted) {
        queue_.pop();
      } else {
        split_before_.insert(longest);
      }
      const ConformingMesh::EdgeSplit split = mesh_.split_edge(longest, 0.5);
      for (const auto& [kept, added] : split.triangles) {
        patch_count_ += patches_per_triangle_[mesh_.source(kept)];
      }
      for (const EdgeKey key : split.new_edges) enqueue(key);
    }
  }

  std::vector<std::uint32_t> finish() { return mesh_.finish(); }

 private:
  /// True if such an edge is never split: the number of patches only grows.
  bool is_short(float length_squared) const {
    const bool enough = settings_.patch_count > 0 && patch_count_ >= settings_.patch_count &&
                        length_squared <= longest_ * longest_;
    const bool fine =
        settings_.patch_size > 0 && length_squared <= settings_.patch_size * settings_.patch_size;
    return enough || fine;
  }

  float density_weight(std::uint32_t source) const {
    return density_weight_.empty() ? 1 : density_weight_[source];
  }

  /// The largest density weight of the triangles at an edge.
  float largest_density_weight(EdgeKey key) const {
    float largest = 0;
    for (const HalfEdge& side : mesh_.triangles(key)) {
      largest = std::max(largest, density_weight(mesh_.source(side.triangle())));
    }
    return largest;
  }

  /// mean_patch_size() with weighted areas.
  double important_patch_size(const Scene& scene) const {
    double area = 0;
    for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
      area += density_weight(t) * patches_per_triangle_[t] * area_of(corners_of(scene, t));
    }
    return std::sqrt(area / static_cast<double>(std::max<std::size_t>(settings_.patch_count, 1)));
  }

  void enqueue(EdgeKey key) {
    const float length_squared = mesh_.length_squared(key) * largest_density_weight(key);
    if (!is_short(length_squared)) queue_.push({length_squared, key});
  }

  ConformingMesh mesh_;
  std::span<const std::uint8_t> patches_per_triangle_;
  const SubdivisionSettings& settings_;
  std::span<const float> density_weight_;
  std::unordered_set<EdgeKey> split_before_;  ///< edges that were longer than an edge in the queue
  std::size_t patch_count_ = 0;
  double longest_ = 0;  ///< metres: shorter edges are split only while there are too few patches
  std::priority_queue<QueuedEdge> queue_;
};

}  // namespace

double mean_patch_size(const Scene& scene, std::span<const std::uint8_t> patches_per_triangle,
                       std::size_t patch_count) {
  double area = 0;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    area += patches_per_triangle[t] * area_of(corners_of(scene, t));
  }
  return std::sqrt(area / static_cast<double>(std::max<std::size_t>(patch_count, 1)));
}

std::vector<std::uint32_t> subdivide(Scene& scene,
                                     std::span<const std::uint8_t> patches_per_triangle,
                                     const SubdivisionSettings& settings,
                                     std::span<const float> density_weight) {
  Subdivision subdivision(scene, patches_per_triangle, settings, density_weight);
  subdivision.run();
  return subdivision.finish();
}

}  // namespace rebounce
