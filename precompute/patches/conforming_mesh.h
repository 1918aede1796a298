#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "precompute/base/edge_table.h"
#include "precompute/import/scene.h"

namespace rebounce {

/// The triangles of a scene, connected where their edges have the same end points, whatever their
/// materials. Edges are split in all triangles that share them, so no T-junction appears.
class ConformingMesh {
 public:
  /// An edge, named by the numbers of the positions of its ends (WeldedPositions).
  using EdgeKey = std::uint64_t;

  /// The two parts of a triangle after a split: `kept` keeps its number, `added` is new.
  struct TriangleSplit {
    std::uint32_t kept, added;
  };

  struct EdgeSplit {
    std::vector<TriangleSplit> triangles;
    std::vector<EdgeKey> new_edges;
  };

  /// `scene` is changed in place and must outlive the object. No triangle may have two corners at
  /// the same position. Throws Error, as does split_edge(), if there are more than kMostTriangles.
  explicit ConformingMesh(Scene& scene);

  const Scene& scene() const { return scene_; }
  std::uint32_t triangle_count() const { return static_cast<std::uint32_t>(source_.size()); }

  /// The original triangle of the scene that contains triangle `t`.
  std::uint32_t source(std::uint32_t t) const { return source_[t]; }

  /// The edge of triangle `t` from a corner to the next.
  EdgeKey edge(std::uint32_t t, int corner) const;

  /// The triangles that share an edge, in the order in which they were connected.
  std::span<const HalfEdge> triangles(EdgeKey key) const;

  /// Squared length of an edge, m².
  float length_squared(EdgeKey key) const;

  /// True if vertex `v` is the end that split_edge measures from.
  bool is_begin(EdgeKey key, std::uint32_t v) const { return position_id_[v] == key >> 32; }

  /// Splits an edge at the fraction 0 < `part` < 1 of the way between its ends. Vertex attributes
  /// are interpolated; vertices that are separate at the ends (seams) are separate at the new
  /// point.
  EdgeSplit split_edge(EdgeKey key, double part);

  /// Moves vertex `v` by the fraction `part` of the way to vertex `to`, with its attributes. The
  /// surface keeps its shape if both are corners of pieces of one flat triangle, and `v` of no
  /// others.
  void move_vertex(std::uint32_t v, std::uint32_t to, double part);

  /// Brings the triangles into their final order, where parts of one original triangle are
  /// neighbours; returns the source of each. The mesh must not be used afterwards.
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
  std::vector<std::uint32_t> next_;  ///< linked list of triangles in their final order
  /// Edges of the original mesh; edges that are split are not looked up again.
  EdgeTable first_edges_;
  std::unordered_map<EdgeKey, std::vector<HalfEdge>> new_edges_;
};

}  // namespace rebounce
