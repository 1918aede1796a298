#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "runtime/demo/picture/picture.h"

namespace rebounce {

/// The light of one picture as values at the vertices [v], in lx.
struct VertexLight {
  std::vector<glm::vec3> sky;
  std::vector<glm::vec3> bounced;  ///< H without the emitters' first flight
};

/// Throws Error if an array of `light` has neither no entries nor one for each patch.
VertexLight light_at_vertices(const TransferData& data, const PictureLight& light);

/// Throws Error if `length` is neither 0 nor `patch_count`.
void check_length(std::size_t length, std::size_t patch_count, const char* name);

}  // namespace rebounce
