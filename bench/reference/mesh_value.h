#pragma once

#include <glm/glm.hpp>
#include <span>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/triangle.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::reference {

/// The value at `position` on a triangle of `mesh` of values at its vertices [v].
inline glm::dvec3 interpolated(const DisplayMesh& mesh, std::span<const Float3> at_vertices,
                               std::uint32_t triangle, const glm::dvec3& position) {
  const glm::dvec3 weight = weights_at(corners_of(mesh, triangle), position);
  glm::dvec3 sum(0);
  for (std::size_t k = 0; k < 3; ++k) {
    sum += weight[static_cast<int>(k)] * to_dvec3(at_vertices[mesh.triangle[triangle][k]]);
  }
  return sum;
}

}  // namespace rebounce::reference
