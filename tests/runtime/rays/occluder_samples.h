#pragma once

// What tests ask of flat pieces of surface.

#include "runtime/rays/occluders.h"

namespace rebounce::test {

/// Whether the way from `a` to `b` goes through a piece.
inline bool crosses(const Occluder& piece, const glm::vec3& a, const glm::vec3& b) {
  const float from = glm::dot(a - piece.corner[0], piece.normal);
  const float to = glm::dot(b - piece.corner[0], piece.normal);
  if ((from > 0) == (to > 0)) return false;
  const glm::vec3 at = glm::mix(a, b, from / (from - to));
  for (std::size_t k = 0; k < Occluder::kCorners; ++k) {
    const glm::vec3 corner = piece.corner[k];
    const glm::vec3 side = piece.corner[(k + 1) % Occluder::kCorners] - corner;
    if (glm::dot(glm::cross(side, at - corner), piece.normal) < 0) return false;
  }
  return true;
}

}  // namespace rebounce::test
