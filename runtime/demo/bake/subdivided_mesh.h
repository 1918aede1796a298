#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A place on the display mesh.
struct MeshPlace {
  std::uint32_t triangle = kNone;
  glm::vec3 weight{0, 0, 0};  ///< barycentric
};

/// The display mesh cut finer: each triangle into `divisions`² equal ones, without T-junctions, but
/// for those that are left whole. Triangles of one material are together, first those that are cut,
/// then those that are not, and share vertices with each other only.
struct SubdividedMesh {
  struct Part {
    std::uint32_t material = 0;
    bool is_whole = false;  ///< its triangles are those of the display mesh
    std::uint32_t triangle_begin = 0, triangle_end = 0;
    std::uint32_t vertex_begin = 0, vertex_end = 0;
  };

  std::vector<MeshPlace> vertex;       ///< [v]
  std::vector<Uint3> triangle;         ///< [t] vertices, counter-clockwise from the front
  std::vector<std::uint32_t> display;  ///< [t] triangle of the display mesh that it is part of
  std::vector<std::array<glm::vec3, 3>> corner;  ///< [t] barycentric weights in that triangle
  std::vector<Part> part;                        ///< one or two for each material that is used
};

/// Cuts `mesh`; `divisions` at least 1. `whole` [t] is not 0 for triangles that are to be left as
/// they are; or it is empty.
SubdividedMesh subdivide(const DisplayMesh& mesh, int divisions,
                         std::span<const std::uint8_t> whole = {});

}  // namespace rebounce
