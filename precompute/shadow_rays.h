#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "rebounce/precompute/form_factor_kernel.h"
#include "rebounce/precompute/patch_model.h"
#include "rebounce/runtime/ray_tracer.h"

namespace rebounce {

/// A patch that another one would exchange light with.
struct FacingPatch {
  std::uint32_t patch;
  double unoccluded;  ///< exchange area in m² with nothing between
};

/// The pairs of patches that face each other, and the shadow rays that find out how much of a
/// pair's exchange gets through. Immutable, usable from any number of threads.
class ShadowRays {
 public:
  /// Sample points per patch, and with it the most rays that a pair can have; a power of two.
  static constexpr std::uint32_t kPointCount = 64;

  /// Spreads the sample points. `tracer` holds the scene that the rays are for. `kernel_tolerance`
  /// is that of unoccluded_exchange_area().
  ShadowRays(const PatchModel& model, const RayTracer& tracer, std::uint64_t seed,
             double kernel_tolerance);

  std::size_t patch_count() const { return triangles_.size(); }
  const FlatTriangle& triangle(std::size_t patch) const { return triangles_[patch]; }

  /// Exchange area in m² of two patches with nothing between them; 0 for a patch with itself.
  double unoccluded(std::uint32_t i, std::uint32_t j) const {
    return unoccluded(i, j, kernel_tolerance_);
  }
  double unoccluded(std::uint32_t i, std::uint32_t j, double tolerance) const;

  /// Point `k` of those spread over a patch, moved off its surface; k counts modulo kPointCount.
  const Float3& point(std::uint32_t patch, std::uint32_t k) const {
    return points_[static_cast<std::size_t>(patch) * kPointCount + k % kPointCount];
  }

  /// Writes to `facing` the patches j > i that patch i would exchange light with, if `wanted`(j),
  /// in ascending order.
  template <typename Wanted>
  void find_facing(std::uint32_t i, std::vector<FacingPatch>& facing, const Wanted& wanted) const;

  /// Writes to `rays` `count` <= kPointCount untraced rays for each pair of patch i, one pair after
  /// the other.
  void make_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                 std::vector<Ray>& rays) const;

  struct Visibility {
    double part;      ///< of the pair's light that gets through, [0, 1]
    double variance;  ///< of `part`
    bool mixed;       ///< some rays got through and some did not
  };

  /// What the traced `rays` of the pair (i, j) say of it: each is weighted by the kernel between
  /// its ends.
  Visibility visibility(std::uint32_t i, std::uint32_t j, std::span<const Ray> rays) const;

  /// What traced rays of `weight` each say.
  static Visibility visible_part(std::span<const Ray> rays, std::span<const double> weight);

 private:
  std::uint64_t pair_hash(std::uint32_t i, std::uint32_t j) const;
  std::pair<const Float3*, const Float3*> ray_ends(std::uint32_t i, std::uint32_t j,
                                                   std::uint32_t k, std::uint64_t hash) const;

  std::uint64_t seed_;
  double kernel_tolerance_;
  std::vector<FlatTriangle> triangles_;  ///< [n]
  std::vector<Float3> points_;           ///< [n][kPointCount], moved off the surface
};

inline double ShadowRays::unoccluded(std::uint32_t i, std::uint32_t j, double tolerance) const {
  const FlatTriangle &a = triangles_[i], &b = triangles_[j];
  const glm::dvec3 d = b.centroid - a.centroid;
  if (glm::dot(a.normal, d) + b.radius <= 0 || a.radius - glm::dot(b.normal, d) <= 0) return 0;
  return unoccluded_exchange_area(a, b, tolerance);
}

template <typename Wanted>
void ShadowRays::find_facing(std::uint32_t i, std::vector<FacingPatch>& facing,
                             const Wanted& wanted) const {
  facing.clear();
  for (std::uint32_t j = i + 1; j < triangles_.size(); ++j) {
    if (!wanted(j)) continue;
    const double exchange = unoccluded(i, j);
    if (exchange > 0) facing.push_back({j, exchange});
  }
}

}  // namespace rebounce
