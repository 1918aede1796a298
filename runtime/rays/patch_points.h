#pragma once

// Patches as sets of display triangles, and points on them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "runtime/rays/cumulative_choice.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "transfer/base/grouped.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The display triangles of each patch, in ascending order.
class PatchTriangles {
 public:
  /// `triangle_patch` [t] is the patch of each display triangle or kNone; patches are <
  /// `patch_count`.
  PatchTriangles(std::span<const std::uint32_t> triangle_patch, std::size_t patch_count);

  std::size_t patch_count() const { return of_patch_.group_count(); }
  std::span<const std::uint32_t> operator[](std::size_t patch) const { return of_patch_[patch]; }

 private:
  Grouped<std::uint32_t> of_patch_;
};

/// A point on one side of the surface.
struct PatchPoint {
  Float3 position{0, 0, 0};  ///< metres
  Float3 normal{0, 0, 0};    ///< unit, of the flat triangle
};

/// A block of points with normals, by coordinates, so that the compiler vectorises loops over them.
struct PatchPointBlock {
  static constexpr std::size_t kSize = 64;
  using Coordinates = std::array<float, kSize>;
  std::array<Coordinates, 3> position, normal;  ///< as in PatchPoint

  glm::vec3 at(std::size_t k) const { return {position[0][k], position[1][k], position[2][k]}; }
  glm::vec3 normal_at(std::size_t k) const { return {normal[0][k], normal[1][k], normal[2][k]}; }
};

/// The surface of a patch that stops light, for sampling points.
class PatchSurface {
 public:
  PatchSurface() = default;
  PatchSurface(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles);

  /// Maps the unit square [0, 1)^2 to the surface, uniformly by area. The first coordinate also
  /// chooses the triangle, or the micro-triangle of its opacity map. Neighbours in the square are
  /// neighbours on the surface. Returns a point with a zero normal if nothing stops light.
  PatchPoint at(const glm::dvec2& square) const {
    // Most patches are one triangle, and callers need millions of points.
    if (pieces_.size() == 1 && choice_.total() > 0)
      return facets_[0].at(square_to_triangle(square));
    return at_chosen_piece(square);
  }

  /// Computes the points of `count` <= PatchPointBlock::kSize squares (`u`[k], `v`[k]), moved by
  /// `offset` metres along their normals; in single precision.
  void fill(std::size_t count, const PatchPointBlock::Coordinates& u,
            const PatchPointBlock::Coordinates& v, float offset, PatchPointBlock& block) const;

 private:
  struct Facet {
    glm::dvec3 corner, first_edge, second_edge;
    Float3 normal;
    int map_level;  ///< level of its opacity map

    PatchPoint at(const glm::dvec2& b) const {  ///< `b`: weights of the second and third vertex
      return {to_float3(corner + b.x * first_edge + b.y * second_edge), normal};
    }
  };
  struct Piece {  ///< an opaque triangle, or a micro-triangle of one with a map
    std::uint32_t facet;
    std::uint32_t micro_triangle;
  };

  static void fill(const Facet& facet, std::size_t count, const PatchPointBlock::Coordinates& u,
                   const PatchPointBlock::Coordinates& v, float offset, PatchPointBlock& block);
  PatchPoint at_chosen_piece(const glm::dvec2& square) const;
  void add(const DisplayMesh& mesh, std::uint32_t triangle);
  void add_pieces(std::span<const std::uint8_t> map, double area);

  std::vector<Facet> facets_;  ///< the triangles of the patch
  std::vector<Piece> pieces_;
  CumulativeChoice choice_;  ///< chooses among pieces_
};

/// Writes points on what of `triangles` of `mesh` stops light (PatchSurface), uniformly by area:
/// the R2 sequence, shifted by `shift`. Every prefix of the sequence is well distributed.
void spread_points(const DisplayMesh& mesh, std::span<const std::uint32_t> triangles,
                   const glm::dvec2& shift, std::span<PatchPoint> points);

}  // namespace rebounce
