#include "runtime/rays/patch_points.h"

#include <algorithm>

#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "runtime/rays/triangle.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {

PatchTriangles::PatchTriangles(std::span<const std::uint32_t> triangle_patch,
                               std::size_t patch_count)
    : of_patch_(patch_count, [&](const auto& add) {
        for (std::uint32_t t = 0; t < triangle_patch.size(); ++t) {
          if (triangle_patch[t] != kNone) add(triangle_patch[t], t);
        }
      }) {}

PatchSurface::PatchSurface(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles) {
  for (const std::uint32_t t : triangles) add(mesh, t);
}

void PatchSurface::add(const DisplayMesh& mesh, std::uint32_t triangle) {
  const auto [a, b, c] = corners_of(mesh, triangle);
  const glm::dvec3 ab = b - a, ac = c - a;
  const glm::dvec3 cross = glm::cross(ab, ac);
  const std::span<const std::uint8_t> map = mesh.opacity.of_triangle(triangle);
  add_pieces(map, glm::length(cross));
  facets_.push_back({a, ab, ac, to_float3(glm::normalize(cross)), opacity_map_level(map.size())});
}

/// Adds the micro-triangles of an opacity map, weighted by their opacity.
void PatchSurface::add_pieces(std::span<const std::uint8_t> map, double area) {
  const auto facet = static_cast<std::uint32_t>(facets_.size());
  if (map.empty()) {
    pieces_.push_back({facet, 0});
    choice_.add(area);
  }
  for (std::uint32_t k = 0; k < map.size(); ++k) {
    pieces_.push_back({facet, k});
    choice_.add(area * map[k] / (OpacityMaps::kOpaque * static_cast<double>(map.size())));
  }
}

PatchPoint PatchSurface::at_chosen_piece(const glm::dvec2& square) const {
  if (!(choice_.total() > 0)) return {};
  const auto [index, rest] = choice_.choose(square.x);
  const auto [number, micro_triangle] = pieces_[index];
  const Facet& facet = facets_[number];
  const glm::dvec2 b = square_to_triangle({rest, square.y});
  TrianglePlace place{b.x, b.y};
  if (facet.map_level > 0) {
    place = place_in_micro_triangle(facet.map_level, micro_triangle, place);
  }
  return facet.at({place.u, place.v});
}

void PatchSurface::fill(std::size_t count, const PatchPointBlock::Coordinates& u,
                        const PatchPointBlock::Coordinates& v, float offset,
                        PatchPointBlock& block) const {
  if (pieces_.size() == 1 && choice_.total() > 0)
    return fill(facets_[0], count, u, v, offset, block);
  for (std::size_t k = 0; k < count; ++k) {
    const PatchPoint point = at_chosen_piece({u[k], v[k]});
    for (int axis = 0; axis < 3; ++axis) {
      block.position[axis][k] = point.position[axis] + offset * point.normal[axis];
      block.normal[axis][k] = point.normal[axis];
    }
  }
}

/// Computes points on one triangle.
void PatchSurface::fill(const Facet& facet, std::size_t count,
                        const PatchPointBlock::Coordinates& u,
                        const PatchPointBlock::Coordinates& v, float offset,
                        PatchPointBlock& block) {
  for (int axis = 0; axis < 3; ++axis) {
    const float normal = facet.normal[axis],
                corner = static_cast<float>(facet.corner[axis] + offset * normal),
                along = static_cast<float>(facet.first_edge[axis]),
                aside = static_cast<float>(facet.second_edge[axis]);
    PatchPointBlock::Coordinates &position = block.position[axis], &normals = block.normal[axis];
    for (std::size_t k = 0; k < count; ++k) {
      const float fold = 0.5F * std::min(u[k], v[k]);  // square_to_triangle
      position[k] = corner + (u[k] - fold) * along + (v[k] - fold) * aside;
      normals[k] = normal;
    }
  }
}

void spread_points(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                   const glm::dvec2& shift, std::span<PatchPoint> points) {
  const PatchSurface surface(mesh, triangles);
  const PointSequence sequence = r2_sequence(shift);
  for (std::uint32_t k = 0; k < points.size(); ++k) points[k] = surface.at(sequence[k]);
}

}  // namespace rebounce
