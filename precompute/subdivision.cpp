#include "rebounce/precompute/subdivision.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>
#include <map>
#include <queue>
#include <unordered_map>

#include "rebounce/runtime/float3_glm.h"

namespace rebounce {
namespace {

using EdgeKey = std::uint64_t;

// A mesh of nothing but large triangles, bisected until there are enough, has no edge longer than
// this many mean patch sizes.
constexpr double kLongestEdge = 2.9;

EdgeKey edge_key(std::uint32_t a, std::uint32_t b) {
  return (static_cast<EdgeKey>(std::min(a, b)) << 32) | std::max(a, b);
}

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
      : scene_(scene), patches_per_triangle_(patches_per_triangle) {
    WeldedPositions welded = weld_positions(scene.position);
    position_id_ = std::move(welded.id);
    position_count_ = welded.count;
    source_.resize(scene.triangle.size());
    next_.resize(scene.triangle.size());
    for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
      source_[t] = t;
      next_[t] = t + 1 < scene.triangle.size() ? t + 1 : kNone;
      patch_count_ += patches_per_triangle[t];
      for (int corner = 0; corner < 3; ++corner) attach_edge(t, corner);
    }
  }

  void run(const SubdivisionSettings& settings) {
    const double longest = kLongestEdge * mean_patch_size(settings.patch_count);
    while (!queue_.empty()) {
      const QueuedEdge edge = queue_.top();
      const bool enough = settings.patch_count > 0 && patch_count_ >= settings.patch_count &&
                          edge.length_squared <= longest * longest;
      const bool fine = settings.patch_size > 0 &&
                        edge.length_squared <= settings.patch_size * settings.patch_size;
      if (enough || fine) break;
      queue_.pop();
      split_edge(edge.key);
    }
  }

  /// Puts the triangles into their final order; returns the source of each.
  std::vector<std::uint32_t> finish() {
    std::vector<Uint3> triangle;
    std::vector<std::uint32_t> material, source;
    for (std::uint32_t t = source_.empty() ? kNone : 0; t != kNone; t = next_[t]) {
      triangle.push_back(scene_.triangle[t]);
      material.push_back(scene_.triangle_material[t]);
      source.push_back(source_[t]);
    }
    scene_.triangle = std::move(triangle);
    scene_.triangle_material = std::move(material);
    return source;
  }

 private:
  /// The root of the mean area of `patch_count` patches, metres.
  double mean_patch_size(std::size_t patch_count) const {
    double area = 0;
    for (std::uint32_t t = 0; t < source_.size(); ++t) {
      const auto [a, b, c] = scene_.triangle[t];
      const glm::dvec3 p = to_dvec3(scene_.position[a]);
      area += 0.5 * patches_per_triangle_[t] *
              glm::length(
                  glm::cross(to_dvec3(scene_.position[b]) - p, to_dvec3(scene_.position[c]) - p));
    }
    return std::sqrt(area / static_cast<double>(std::max<std::size_t>(patch_count, 1)));
  }

  void attach_edge(std::uint32_t t, int corner) {
    const std::uint32_t a = scene_.triangle[t][corner], b = scene_.triangle[t][(corner + 1) % 3];
    const EdgeKey key = edge_key(position_id_[a], position_id_[b]);
    std::vector<std::uint32_t>& triangles = triangles_of_edge_[key];
    if (triangles.empty()) {
      const glm::vec3 d = to_glm(scene_.position[a]) - to_glm(scene_.position[b]);
      queue_.push({glm::dot(d, d), key});
    }
    triangles.push_back(t);
  }

  void split_edge(EdgeKey key) {
    const auto found = triangles_of_edge_.find(key);
    const std::vector<std::uint32_t> triangles = std::move(found->second);
    triangles_of_edge_.erase(found);
    const std::uint32_t middle_id = position_count_++;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle_vertex;
    for (const std::uint32_t t : triangles) {
      int corner = 0;
      while (corner_edge_key(t, corner) != key) ++corner;
      const Uint3 old = scene_.triangle[t];
      const std::uint32_t a = old[corner], b = old[(corner + 1) % 3], c = old[(corner + 2) % 3];
      const auto [entry, is_new] = middle_vertex.try_emplace(std::minmax(a, b), kNone);
      if (is_new) entry->second = add_middle(entry->first.first, entry->first.second, middle_id);
      split_triangle(t, {a, b, c}, entry->second);
    }
  }

  EdgeKey corner_edge_key(std::uint32_t t, int corner) const {
    return edge_key(position_id_[scene_.triangle[t][corner]],
                    position_id_[scene_.triangle[t][(corner + 1) % 3]]);
  }

  /// Triangle t = (a, b, c) becomes (a, m, c), and a new one is (m, b, c).
  void split_triangle(std::uint32_t t, const Uint3& abc, std::uint32_t middle) {
    const auto [a, b, c] = abc;
    const auto other = static_cast<std::uint32_t>(scene_.triangle.size());
    scene_.triangle[t] = {a, middle, c};
    scene_.triangle.push_back({middle, b, c});
    scene_.triangle_material.push_back(scene_.triangle_material[t]);
    source_.push_back(source_[t]);
    next_.push_back(next_[t]);
    next_[t] = other;
    patch_count_ += patches_per_triangle_[source_[t]];

    std::vector<std::uint32_t>& bc =
        triangles_of_edge_.at(edge_key(position_id_[b], position_id_[c]));
    *std::find(bc.begin(), bc.end(), t) = other;
    attach_edge(t, 0);      // a, m
    attach_edge(t, 1);      // m, c
    attach_edge(other, 0);  // m, b
    attach_edge(other, 2);  // c, m
  }

  std::uint32_t add_middle(std::uint32_t a, std::uint32_t b, std::uint32_t position_id) {
    const auto middle = static_cast<std::uint32_t>(scene_.position.size());
    const auto average = [&](auto& values) {
      auto value = values[a];
      for (std::size_t k = 0; k < value.size(); ++k)
        value[k] = 0.5F * (values[a][k] + values[b][k]);
      values.push_back(value);
    };
    average(scene_.position);
    average(scene_.normal);
    average(scene_.base_color_texcoord);
    average(scene_.emissive_texcoord);
    average(scene_.vertex_color);
    const glm::vec3 normal = to_glm(scene_.normal[middle]);
    const float length = glm::length(normal);
    scene_.normal[middle] = length > 1e-6F ? to_float3(normal / length) : scene_.normal[a];
    position_id_.push_back(position_id);
    return middle;
  }

  Scene& scene_;
  std::span<const std::uint8_t> patches_per_triangle_;
  std::vector<std::uint32_t> position_id_;
  std::uint32_t position_count_ = 0;
  std::vector<std::uint32_t> source_;
  std::vector<std::uint32_t> next_;  ///< list of triangles in their final order
  std::size_t patch_count_ = 0;
  std::unordered_map<EdgeKey, std::vector<std::uint32_t>> triangles_of_edge_;
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

std::vector<std::uint32_t> subdivide(Scene& scene,
                                     std::span<const std::uint8_t> patches_per_triangle,
                                     const SubdivisionSettings& settings) {
  Subdivision subdivision(scene, patches_per_triangle);
  subdivision.run(settings);
  return subdivision.finish();
}

}  // namespace rebounce
