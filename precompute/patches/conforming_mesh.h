#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "precompute/base/edge_table.h"
#include "precompute/import/scene.h"

namespace rebounce {

/// The triangles of a scene, joined where their edges have the same end points, whatever their
/// materials. Edges are split in all triangles that share them, so no T-junction ever appears.
class ConformingMesh {
 public:
  /// Names an edge by the numbers of its ends' positions (WeldedPositions).
  using EdgeKey = std::uint64_t;

  /// What a split made of one triangle: `kept` is what is left of it, `added` the rest.
  struct TriangleSplit {
    std::uint32_t kept, added;
  };

  struct EdgeSplit {
    std::vector<TriangleSplit> triangles;
    std::vector<EdgeKey> new_edges;
  };

  /// `scene` is changed in place and must outlive this. No triangle may have corners at the same
  /// position.
  explicit ConformingMesh(Scene& scene);

  const Scene& scene() const { return scene_; }
  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(source_.size()); }

  /// The triangle of the scene as it was that triangle `t` came from.
  std::uint32_t source(std::uint32_t t) const { return source_[t]; }

  /// The edge of triangle `t` from a corner to the next.
  EdgeKey edge(std::uint32_t t, int corner) const;

  /// Triangles that share an edge, in the order in which they were joined to it.
  std::span<const HalfEdge> triangles(EdgeKey key) const;

  /// Metres squared.
  float length_squared(EdgeKey key) const;

  /// True if vertex `v` is the end of the edge from which split_edge measures.
  bool is_begin(EdgeKey key, std::uint32_t v) const { return position_id_[v] == key >> 32; }

  /// Splits an edge at the part 0 < `part` < 1 of the way between its ends. Vertex attributes are
  /// interpolated; vertices that were apart at the ends (seams) are apart in between.
  EdgeSplit split_edge(EdgeKey key, double part);

  /// Moves vertex `v` by `part` of the way to vertex `to`, attributes and all. The surface stays as
  /// it was if both are corners of pieces of one flat triangle, and `v` of no others.
  void move_vertex(std::uint32_t v, std::uint32_t to, double part);

  /// Puts the triangles into their final order, those that come from one together; returns the
  /// source of each. The mesh must not be used afterwards.
  std::vector<std::uint32_t> finish();

 private:
  static std::uint32_t low_end(EdgeKey key) { return static_cast<std::uint32_t>(key >> 32); }
  static std::uint32_t high_end(EdgeKey key) { return static_cast<std::uint32_t>(key); }
  std::span<HalfEdge> half_edges(EdgeKey key);
  void attach_edge(std::uint32_t t, int corner, std::vector<EdgeKey>& new_edges);
  std::uint32_t split_triangle(std::uint32_t t, int corner, std::uint32_t middle,
                               std::vector<EdgeKey>& new_edges);
  std::uint32_t add_vertex(std::uint32_t a, std::uint32_t b, double part, std::uint32_t id);

  Scene& scene_;
  std::vector<std::uint32_t> position_id_;
  std::uint32_t position_count_ = 0;
  std::vector<std::uint32_t> source_;
  std::vector<std::uint32_t> next_;  ///< list of triangles in their final order
  EdgeTable first_edges_;  ///< those of the mesh as it was; what is split is no longer asked for
  std::unordered_map<EdgeKey, std::vector<HalfEdge>> new_edges_;
};

}  // namespace rebounce
