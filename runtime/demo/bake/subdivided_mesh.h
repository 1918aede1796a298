#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A point on the display mesh.
struct MeshPlace {
  std::uint32_t triangle = kNone;
  glm::vec3 weight{0, 0, 0};  ///< barycentric
};

/// The display mesh with each triangle divided into `divisions`² equal ones, without T-junctions;
/// some triangles may stay whole. Triangles of one material are contiguous, the divided ones first.
/// They share vertices only with each other.
struct SubdividedMesh {
  struct Part {
    std::uint32_t material = 0;
    bool is_whole = false;  ///< its triangles are those of the display mesh
    std::uint32_t triangle_begin = 0, triangle_end = 0;
    std::uint32_t vertex_begin = 0, vertex_end = 0;
  };

  std::vector<MeshPlace> vertex;                 ///< [v]
  std::vector<Uint3> triangle;                   ///< [t] vertices, counter-clockwise from the front
  std::vector<std::uint32_t> display;            ///< [t] display triangle that it is part of
  std::vector<std::array<glm::vec3, 3>> corner;  ///< [t] barycentric weights in that triangle
  std::vector<Part> part;                        ///< one or two for each used material
};

/// Divides `mesh`; `divisions` is at least 1. `whole` [t] is not 0 for triangles that stay whole;
/// it may be empty.
SubdividedMesh subdivide(const DisplayMesh& mesh, int divisions,
                         std::span<const std::uint8_t> whole = {});

}  // namespace rebounce
