#pragma once

// Longest-edge bisection of a conforming mesh: M.-C. Rivara, "New longest-edge algorithms for the
// refinement and/or improvement of unstructured triangulations" (1997).

#include "precompute/patches/conforming_mesh.h"

namespace rebounce {

/// The longest edge of triangle `t`; of equal ones always the same.
ConformingMesh::EdgeKey longest_edge(const ConformingMesh& mesh, std::uint32_t t);

/// Where the longest-edge propagation path from an edge ends: an edge that is the longest of all
/// triangles that share it. To bisect `key` itself and keep all angles bounded, this one is split
/// in the middle over and over, until it is `key`.
ConformingMesh::EdgeKey end_of_longest_edge_path(const ConformingMesh& mesh,
                                                 ConformingMesh::EdgeKey key);

}  // namespace rebounce
