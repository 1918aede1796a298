#include "precompute/patches/longest_edges.h"

namespace rebounce {
namespace {

using EdgeKey = ConformingMesh::EdgeKey;

bool is_longer(const ConformingMesh& mesh, EdgeKey a, EdgeKey b) {
  const float la = mesh.length_squared(a), lb = mesh.length_squared(b);
  return la != lb ? la > lb : a < b;
}

/// The longest edge of the triangles that share an edge.
EdgeKey longest_around(const ConformingMesh& mesh, EdgeKey key) {
  EdgeKey longest = key;
  for (const HalfEdge& side : mesh.triangles(key)) {
    const EdgeKey of_triangle = longest_edge(mesh, side.triangle());
    if (is_longer(mesh, of_triangle, longest)) longest = of_triangle;
  }
  return longest;
}

}  // namespace

EdgeKey longest_edge(const ConformingMesh& mesh, std::uint32_t t) {
  EdgeKey longest = mesh.edge(t, 0);
  for (int corner = 1; corner < 3; ++corner) {
    if (is_longer(mesh, mesh.edge(t, corner), longest)) longest = mesh.edge(t, corner);
  }
  return longest;
}

EdgeKey end_of_longest_edge_path(const ConformingMesh& mesh, EdgeKey key) {
  for (EdgeKey longer = longest_around(mesh, key); longer != key;
       longer = longest_around(mesh, key)) {
    key = longer;
  }
  return key;
}

}  // namespace rebounce
