#pragma once

// The shape of patches as form factors need it: their triangles, bounds, and points on them.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/form_factor_kernel.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// A sphere around a patch and a cone around its normals.
struct PatchBounds {
  glm::dvec3 centre{0};
  double radius = 0;       ///< metres
  glm::dvec3 axis{0};      ///< unit; the normal of a flat patch
  double thickness = 0;    ///< metres: the largest distance of a point from the plane across `axis`
  double cone_cosine = 1;  ///< of the widest angle between `axis` and a normal
  double cone_sine = 0;

  /// True if the patch lies in one plane, for the purpose of light.
  bool is_flat() const;

  /// False if the sphere of `sphere_radius` around `point` lies behind every part of the patch.
  bool may_face(const glm::dvec3& point, double sphere_radius) const;
};

/// A part of a patch taken as a point. Its area counts as projected: the normals of a part that is
/// not flat cancel in part, as its projections do. There are 63 parts of each patch, so numbers are
/// of single precision.
struct PatchPart {
  glm::vec3 centroid{0};
  glm::vec3 vector_area{0};  ///< m²: the sum of area x normal
  float area = 0;            ///< m², of the surface that stops light
  float radius = 0;          ///< of the sphere around the centroid, metres
};

/// The shapes of all patches. Immutable, usable from any number of threads.
class PatchGeometry {
 public:
  /// A patch is cut into at most 2^kPartLevels parts.
  static constexpr int kPartLevels = 5;

  /// `tracer` holds the scene; points are moved off its surface.
  PatchGeometry(const PatchModel& model, const RayTracer& tracer);

  std::size_t patch_count() const { return bounds_.size(); }
  /// M², of the surface that stops light.
  double area(std::size_t patch) const { return area_[patch]; }
  std::vector<double> areas() const { return area_; }
  const PatchBounds& bounds(std::size_t patch) const { return bounds_[patch]; }

  /// The triangles of a patch, at least one.
  std::span<const FlatTriangle> triangles(std::size_t patch) const {
    return {triangle_.data() + begin_[patch], triangle_.data() + begin_[patch + 1]};
  }

  /// The point of the surface that `square` in [0, 1)^2 maps to (PatchSurface), moved off the
  /// surface.
  PatchPoint point(std::size_t patch, const glm::dvec2& square) const {
    PatchPoint point = surface_[patch].at(square);
    for (int axis = 0; axis < 3; ++axis) point.position[axis] += offset_ * point.normal[axis];
    return point;
  }

  /// The points of `count` squares (`u`[k], `v`[k]), likewise (PatchSurface::fill).
  void points(std::size_t patch, std::size_t count, const PatchPointBlock::Coordinates& u,
              const PatchPointBlock::Coordinates& v, PatchPointBlock& block) const {
    surface_[patch].fill(count, u, v, offset_, block);
  }

  /// Three points near corners that span about the largest triangle, moved off the surface.
  std::span<const PatchPoint, 3> outermost_points(std::size_t patch) const {
    return outermost_[patch];
  }

  /// The 2^`level` parts that make up the patch. `level` is at most kPartLevels, and at least
  /// flat_level(patch) if the parts replace the patch.
  std::span<const PatchPart> parts(std::size_t patch, int level) const;

  /// The triangles, cut where necessary, of a part of the finest level. None for a patch of so few
  /// triangles that no sum of pairs needs them.
  std::span<const FlatTriangle> fragments(std::size_t patch, std::size_t part) const {
    const std::vector<std::uint32_t>& begin = fragments_[patch].begin;
    return std::span(fragments_[patch].triangle)
        .subspan(begin[part], begin[part + 1] - begin[part]);
  }

  /// The lowest level whose parts are about flat, or kPartLevels.
  int flat_level(std::size_t patch) const { return flat_level_[patch]; }

 private:
  /// The triangles of the finest parts, part by part.
  struct Fragments {
    std::vector<FlatTriangle> triangle;
    std::vector<std::uint32_t> begin;  ///< [parts + 1]
  };

  void add_parts(std::size_t patch, bool with_fragments);

  std::vector<std::uint32_t> begin_;    ///< [n + 1]
  std::vector<FlatTriangle> triangle_;  ///< those of patch i at [begin_[i], begin_[i + 1])
  std::vector<double> area_;            ///< [n] m²
  std::vector<PatchBounds> bounds_;     ///< [n]
  std::vector<PatchSurface> surface_;   ///< [n]
  float offset_;                        ///< distance of points from the surface, metres
  std::vector<std::array<PatchPoint, 3>> outermost_;  ///< [n]
  std::vector<Fragments> fragments_;                  ///< [n], some of them empty
  std::vector<std::uint8_t> flat_level_;              ///< [n]
  std::vector<PatchPart> parts_;                      ///< [n][all levels, the coarsest first]
};

/// True for a pair (i, j) so near that the few points of shadow rays cannot represent all that
/// varies between the patches: the sum of the radii is above 0.6 of the distance. A patch is near
/// itself.
bool is_near_pair(const PatchGeometry& geometry, std::size_t i, std::size_t j);

/// True for a near pair (i, j) of many triangles. The kernel of such a pair is slow and coarse, and
/// hemisphere rays estimate its exchange better.
bool is_coarse_pair(const PatchGeometry& geometry, std::size_t i, std::size_t j);

/// Exchange area A_i F_ij in m² of patches i and j with nothing between them: symmetric up to
/// rounding, >= 0. For i == j it is the exchange of a patch that is not flat with itself.
///
/// Pairs of few triangles use the kernel of their triangles (`tolerance`: form_factor_kernel.h).
/// Other pairs are sums over parts where these are small for their distance, and from parts to
/// triangles in closed form where they are near.
double unoccluded_exchange_area(const PatchGeometry& geometry, std::size_t i, std::size_t j,
                                double tolerance);

}  // namespace rebounce
