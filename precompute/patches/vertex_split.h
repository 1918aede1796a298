#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Appends a copy of vertex `v` and returns its number.
std::uint32_t copy_vertex(DisplayMesh& mesh, std::uint32_t v);

/// Gives a vertex on which something stands (a wall on the floor, the edge of a slab in a wall) a
/// copy for each side of it, so that each side shows its own light. Triangles around a vertex keep
/// sharing it if they meet at an edge with nothing on it and bend by at most about 50 degrees.
/// Covered triangles (covers.h, by covers no higher than `cover_height` metres) have vertices of
/// their own. `shown_patch` [t] is the patch that each display triangle shows, or kNone. A vertex
/// of triangles without a patch stays one; where they meet others in the open they share its light,
/// because their corners may be visible. `tracer` holds the surface of `mesh`. Returns the vertex
/// that each appended one is a copy of.
std::vector<std::uint32_t> split_vertices(std::span<const std::uint32_t> shown_patch,
                                          const RayTracer& tracer, double cover_height,
                                          DisplayMesh& mesh);

}  // namespace rebounce
