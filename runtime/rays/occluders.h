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

struct Occluders {
  std::vector<Occluder> piece;
  bool is_whole = true;  ///< false: only a part of the surface
};

/// The surface that `mesh` traces rays against (its first surface_count() triangles), cut into
/// pieces anew: neighbouring triangles in one plane, to a quarter of ray_offset_distance(), are
/// joined first. Pieces near each other follow each other. If there are more than `most` planes,
/// only `largest` are taken, those of the largest triangles.
Occluders find_occluders(const DisplayMesh& mesh, std::size_t most, std::size_t largest);

}  // namespace rebounce
