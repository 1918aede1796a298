#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "precompute/import/scene.h"

namespace rebounce {

/// A piece of the surface of the scene that is seen from behind.
struct InsideOutPiece {
  std::vector<std::uint32_t> triangle;  ///< indices in the scene, ascending
  double area = 0;                      ///< m²
  /// Of the rays from other pieces that meet it, the fraction that meets its front.
  double front_share = 0;
  /// Flux density on its back relative to the exitance of fronts, [0, 1].
  double back_coverage = 0;
};

/// Finds the one-sided pieces of a scene whose back clearly is the used side: walls of a room that
/// face outwards, a ceiling that is turned over. With one-sided reflection they absorb all light;
/// their triangles should be double-sided.
///
/// A piece is a set of triangles joined by edges that both triangles run through in opposite
/// directions, so that a reversed part of a mesh is a piece of its own. Cosine-distributed rays
/// leave the reflecting sides of all surfaces, in proportion to area. A piece is inside out if
/// almost no ray of other pieces meets its front and a substantial fraction of its back is met. A
/// scene whose fronts see nothing while its backs see each other (an empty room that faces
/// outwards, but also a single convex solid) is inside out as a whole. Closed solids, outer shells
/// of rooms and posters on walls are not: their backs are not seen, or their fronts are seen too.
///
/// Deterministic. The largest piece comes first.
std::vector<InsideOutPiece> find_inside_out(const Scene& scene);

/// Gives the triangles of `pieces` double-sided copies of their materials, and adds a warning to
/// the scene if there are any.
void make_double_sided(Scene& scene, std::span<const InsideOutPiece> pieces);

/// The scene of a file as the offline stage takes it: pieces that are plainly seen from behind are
/// double-sided (find_inside_out). Throws Error as import_gltf does.
Scene import_usable(const std::filesystem::path& path, double scale);

}  // namespace rebounce
