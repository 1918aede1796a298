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
/// copy for each side of it, so that each side shows its own light: triangles around a vertex keep
/// sharing it where they meet at an edge with nothing between them and do not bend away from each
/// other by more than about 50 degrees. What is covered (covers.h, by what hangs no higher
/// than `cover_height` metres) has vertices of its own too. `shown_patch` [t] is the patch that
/// each display triangle shows, or kNone: a vertex of nothing but these stays one, and where they
/// meet others in the open they share its light, as their corners may be seen. `tracer` holds the
/// surface of `mesh`. Returns the vertex that each of the appended ones is a copy of.
std::vector<std::uint32_t> split_vertices(std::span<const std::uint32_t> shown_patch,
                                          const RayTracer& tracer, double cover_height,
                                          DisplayMesh& mesh);

}  // namespace rebounce
