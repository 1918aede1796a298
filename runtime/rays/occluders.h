#pragma once

// The surface of a scene as few flat pieces, for shadows that are found without rays.

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A flat convex piece of surface. It stops light on both sides.
struct Occluder {
  static constexpr std::size_t kCorners = 4;
  /// Counter-clockwise around `normal`. A triangle has its last corner twice.
  std::array<glm::vec3, kCorners> corner;
  glm::vec3 normal;  ///< unit
  bool solid;        ///< false: light may get through, by an opacity map
};

/// The surface that `mesh` traces rays against (its first surface_count() triangles), with
/// neighbouring triangles of one plane joined wherever that gives a convex piece of at most four
/// corners. Pieces deviate from the triangles by less than a quarter of ray_offset_distance().
/// Returns nothing if there are more than `most` pieces.
std::vector<Occluder> occluders_of(const DisplayMesh& mesh, std::size_t most);

}  // namespace rebounce
