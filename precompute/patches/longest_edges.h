#pragma once

// Longest-edge bisection of a conforming mesh: M.-C. Rivara, "New longest-edge algorithms for the
// refinement and/or improvement of unstructured triangulations" (1997).

#include "precompute/patches/conforming_mesh.h"

namespace rebounce {

/// The longest edge of triangle `t`; among equal ones always the same.
ConformingMesh::EdgeKey longest_edge(const ConformingMesh& mesh, std::uint32_t t);

/// The end of the longest-edge propagation path from an edge: an edge that is the longest of all
/// triangles that share it. To bisect `key` itself and keep all angles bounded, split this edge in
/// the middle again and again until it is `key`.
ConformingMesh::EdgeKey end_of_longest_edge_path(const ConformingMesh& mesh,
                                                 ConformingMesh::EdgeKey key);

}  // namespace rebounce
