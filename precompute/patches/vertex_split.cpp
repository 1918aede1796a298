#include "precompute/patches/vertex_split.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "precompute/patches/covers.h"
#include "precompute/patches/element_neighbours.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"
#include "transfer/base/grouped.h"

namespace rebounce {
namespace {

// The place where an edge is tested: this fraction of it away from the vertex, and on either side
// this fraction of the way to the third corner.
constexpr double kAlongEdge = 0.25, kAwayFromEdge = 0.1;

/// The display triangles around each vertex, in ascending order.
class VertexTriangles {
 public:
  explicit VertexTriangles(const DisplayMesh& mesh)
      : of_vertex_(mesh.position.size(), [&](const auto& add) {
          for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
            for (const std::uint32_t v : mesh.triangle[t]) add(v, t);
          }
        }) {}

  /// The part for vertex `v` of a list with an entry for each triangle of each vertex.
  template <typename List>
  auto of(List& list, std::uint32_t v) const {
    return std::span(list).subspan(of_vertex_.offsets()[v], of_vertex_[v].size());
  }

  std::span<const std::uint32_t> operator[](std::uint32_t v) const { return of_vertex_[v]; }

  std::size_t corner_count() const { return of_vertex_.size(); }

 private:
  Grouped<std::uint32_t> of_vertex_;
};

class VertexSplitter {
 public:
  VertexSplitter(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                 const RayTracer& tracer, double cover_height)
      : mesh_(mesh), tracer_(tracer), is_covered_(mesh.triangle.size(), 0) {
#pragma omp parallel for schedule(dynamic, 256)
    for (std::size_t t = 0; t < is_covered_.size(); ++t) {
      if (shown_patch[t] == kNone) continue;
      const TriangleCorners corners = corners_of(mesh, static_cast<std::uint32_t>(t));
      is_covered_[t] = is_covered(corners, tracer, cover_height) ? 1 : 0;
    }
  }

  /// Writes the groups of the `around` triangles of a vertex that share it to `label`, numbered in
  /// the order of first use.
  void find_groups(std::uint32_t v, std::span<const std::uint32_t> around,
                   std::span<std::uint32_t> label) const {
    std::iota(label.begin(), label.end(), 0U);
    for (std::size_t a = 0; a < around.size(); ++a) {
      for (std::size_t b = a + 1; b < around.size(); ++b) {
        if (label[a] == label[b] || !are_joined(v, around[a], around[b])) continue;
        const auto [kept, merged] = std::minmax(label[a], label[b]);
        std::ranges::replace(label, std::uint32_t{merged}, std::uint32_t{kept});
      }
    }
    std::uint32_t count = 0;
    // A group has the number of its first triangle.
    for (std::size_t k = 0; k < label.size(); ++k) {
      label[k] = label[k] == k ? count++ : label[label[k]];
    }
  }

 private:
  /// True if both triangles `a` and `b` are covered or neither is, they share an edge from `v`, and
  /// nothing stands on the edge. Triangles without a patch join the open ones, because only their
  /// open parts are visible.
  bool are_joined(std::uint32_t v, std::uint32_t a, std::uint32_t b) const {
    return is_covered_[a] == is_covered_[b] &&
           std::ranges::any_of(mesh_.triangle[a], [&](std::uint32_t u) {
             return u != v && std::ranges::count(mesh_.triangle[b], u) > 0 &&
                    find_between(beside_edge(v, u, a), beside_edge(v, u, b), tracer_) == kNone;
           });
  }

  /// A point of triangle `t` near its edge from `v` to `u`.
  PatchPoint beside_edge(std::uint32_t v, std::uint32_t u, std::uint32_t t) const {
    const auto [a, b, c] = mesh_.triangle[t];
    const std::uint32_t third = a != v && a != u ? a : b != v && b != u ? b : c;
    const auto at = [&](std::uint32_t k) { return to_dvec3(mesh_.position[k]); };
    const glm::dvec3 on_edge = glm::mix(at(v), at(u), kAlongEdge);
    const glm::dvec3 normal = front_normal(corners_of(mesh_, t));
    return {to_float3(glm::mix(on_edge, at(third), kAwayFromEdge)), to_float3(normal)};
  }

  const DisplayMesh& mesh_;
  const RayTracer& tracer_;
  std::vector<std::uint8_t> is_covered_;  ///< [t] it shows a patch and is covered
};

}  // namespace

std::uint32_t copy_vertex(DisplayMesh& mesh, std::uint32_t v) {
  const auto append = [v](auto& of_vertex) {
    const auto value = of_vertex[v];
    of_vertex.push_back(value);
  };
  append(mesh.position);
  append(mesh.normal);
  append(mesh.base_color_texcoord);
  append(mesh.emissive_texcoord);
  append(mesh.vertex_color);
  return static_cast<std::uint32_t>(mesh.position.size() - 1);
}

std::vector<std::uint32_t> split_vertices(std::span<const std::uint32_t> shown_patch,
                                          const RayTracer& tracer, double cover_height,
                                          DisplayMesh& mesh) {
  const VertexTriangles around(mesh);
  const auto vertex_count = static_cast<std::uint32_t>(mesh.position.size());
  std::vector<std::uint32_t> groups(around.corner_count());
  const VertexSplitter splitter(mesh, shown_patch, tracer, cover_height);
#pragma omp parallel for schedule(dynamic, 256)
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    const auto shows = [&](std::uint32_t t) { return shown_patch[t] != kNone; };
    if (std::ranges::none_of(around[v], shows)) continue;  // its triangles are one group
    splitter.find_groups(v, around[v], around.of(groups, v));
  }
  std::vector<std::uint32_t> vertex_of, copied;
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    const std::span<const std::uint32_t> group = around.of(groups, v);
    vertex_of.assign(1, v);
    for (std::size_t k = 0; k < group.size(); ++k) {
      while (vertex_of.size() <= group[k]) {
        vertex_of.push_back(copy_vertex(mesh, v));
        copied.push_back(v);
      }
      std::ranges::replace(mesh.triangle[around[v][k]], v, vertex_of[group[k]]);
    }
  }
  return copied;
}

}  // namespace rebounce
