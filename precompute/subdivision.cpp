#include "rebounce/precompute/subdivision.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>
#include <queue>
#include <unordered_map>

#include "conforming_mesh.h"
#include "rebounce/runtime/float3_glm.h"

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
  Subdivision(Scene& scene, std::span<const std::uint8_t> patches_per_triangle)
      : mesh_(scene), patches_per_triangle_(patches_per_triangle) {
    for (std::uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      patch_count_ += patches_per_triangle[t];
      for (int corner = 0; corner < 3; ++corner) {
        const EdgeKey key = mesh_.edge(t, corner);
        if (mesh_.triangles(key).front() == t) enqueue(key);
      }
    }
  }

  void run(const SubdivisionSettings& settings) {
    const double longest =
        kLongestEdge * mean_patch_size(mesh_.scene(), patches_per_triangle_, settings.patch_count);
    while (!queue_.empty()) {
      const QueuedEdge edge = queue_.top();
      const bool enough = settings.patch_count > 0 && patch_count_ >= settings.patch_count &&
                          edge.length_squared <= longest * longest;
      const bool fine = settings.patch_size > 0 &&
                        edge.length_squared <= settings.patch_size * settings.patch_size;
      if (enough || fine) break;
      queue_.pop();
      const ConformingMesh::EdgeSplit split = mesh_.split_edge(edge.key, 0.5);
      for (const auto& [kept, added] : split.triangles) {
        patch_count_ += patches_per_triangle_[mesh_.source(kept)];
      }
      for (const EdgeKey key : split.new_edges) enqueue(key);
    }
  }

  std::vector<std::uint32_t> finish() { return mesh_.finish(); }

 private:
  void enqueue(EdgeKey key) { queue_.push({mesh_.length_squared(key), key}); }

  ConformingMesh mesh_;
  std::span<const std::uint8_t> patches_per_triangle_;
  std::size_t patch_count_ = 0;
  std::priority_queue<QueuedEdge> queue_;
};

}  // namespace

WeldedPositions weld_positions(std::span<const Float3> position) {
  struct Hash {
    std::size_t operator()(const Float3& p) const {
      std::uint64_t hash = 0;
      for (const float x : p) {
        // Adding zero makes -0 and +0 one.
        hash = (hash ^ std::bit_cast<std::uint32_t>(x + 0.0F)) * 0x9E3779B97F4A7C15ULL;
        hash ^= hash >> 29;
      }
      return hash;
    }
  };
  WeldedPositions welded;
  welded.id.reserve(position.size());
  std::unordered_map<Float3, std::uint32_t, Hash> id_of;
  id_of.reserve(position.size());
  for (const Float3& p : position) {
    welded.id.push_back(
        id_of.try_emplace(p, static_cast<std::uint32_t>(id_of.size())).first->second);
  }
  welded.count = static_cast<std::uint32_t>(id_of.size());
  return welded;
}

double mean_patch_size(const Scene& scene, std::span<const std::uint8_t> patches_per_triangle,
                       std::size_t patch_count) {
  double area = 0;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const auto [a, b, c] = scene.triangle[t];
    const glm::dvec3 p = to_dvec3(scene.position[a]);
    area +=
        0.5 * patches_per_triangle[t] *
        glm::length(glm::cross(to_dvec3(scene.position[b]) - p, to_dvec3(scene.position[c]) - p));
  }
  return std::sqrt(area / static_cast<double>(std::max<std::size_t>(patch_count, 1)));
}

std::vector<std::uint32_t> subdivide(Scene& scene,
                                     std::span<const std::uint8_t> patches_per_triangle,
                                     const SubdivisionSettings& settings) {
  Subdivision subdivision(scene, patches_per_triangle);
  subdivision.run(settings);
  return subdivision.finish();
}

}  // namespace rebounce
