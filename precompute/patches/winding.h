#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "precompute/import/scene.h"

namespace rebounce {

/// A piece of the scene's surface that is seen from behind.
struct InsideOutPiece {
  std::vector<std::uint32_t> triangle;  ///< indices in the scene, ascending
  double area = 0;                      ///< m²
  double front_share = 0;    ///< of the rays that meet it from other pieces, how many see its front
  double back_coverage = 0;  ///< flux density on its back relative to the fronts' exitance, [0, 1]
};

/// Finds the one-sided pieces of a scene whose back plainly is the side that is lived with: walls
/// of a room that face outwards, a ceiling that was turned over. To one-sided reflection they are
/// black holes; their triangles should be taken as double-sided.
///
/// A piece is a set of triangles joined by edges that both sides run through in opposite
/// directions, so that a turned part of a mesh is a piece of its own. Cosine-distributed rays leave
/// the reflecting sides of all surfaces, in proportion to area; a piece is inside out where
/// practically no ray of other pieces meets its front and a fair share of its back is met. A scene
/// whose fronts see nothing at all while its backs see each other (an empty room that faces
/// outwards, but also a single convex solid that stands alone) is inside out as a whole. Closed
/// solids, outer shells of rooms, posters on walls are not: their backs are not seen, or their
/// fronts are too.
///
/// Deterministic. Largest piece first. Throws Error if there is no memory for a ray tracer.
std::vector<InsideOutPiece> find_inside_out(const Scene& scene);

/// Gives the triangles of `pieces` double-sided copies of their materials, and the scene a warning
/// where there are any.
void make_double_sided(Scene& scene, std::span<const InsideOutPiece> pieces);

/// The scene of a file as the offline stage takes it: pieces that are plainly seen from behind are
/// double-sided (find_inside_out). Throws Error as import_gltf does.
Scene import_usable(const std::filesystem::path& path, double scale);

}  // namespace rebounce
