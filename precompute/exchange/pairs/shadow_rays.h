#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "precompute/exchange/pairs/patch_geometry.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The other patch of a pair that exchanges light.
struct FacingPatch {
  std::uint32_t patch;
  double unoccluded;        ///< exchange area in m² with nothing between
  std::uint32_t count = 0;  ///< hemisphere rays between the two, from either side
};

/// An estimate, from weighted rays, of the fraction of light that passes.
class VisibilityEstimate {
 public:
  /// Adds a ray of `weight` >= 0; the fraction `transmitted` in [0, 1] of its light passes.
  void add(double weight, double transmitted) {
    sum_ += weight;
    sum_of_squares_ += weight * weight;
    visible_ += weight * transmitted;
    visible_squared_ += weight * transmitted * transmitted;
  }

  void add(const VisibilityEstimate& other) {
    sum_ += other.sum_;
    sum_of_squares_ += other.sum_of_squares_;
    visible_ += other.visible_;
    visible_squared_ += other.visible_squared_;
  }

  /// No ray has weight: the values below are undefined.
  bool is_empty() const { return sum_ <= 0; }
  double part() const { return visible_ / sum_; }

  /// Variance of single rays.
  double spread() const { return std::max(0.0, visible_squared_ / sum_ - part() * part()); }

  /// The number of rays of equal weight with the same certainty (Kish's effective sample size).
  double effective_count() const { return sum_ * sum_ / sum_of_squares_; }
  double variance() const { return spread() / effective_count(); }  ///< of part()

 private:
  double sum_ = 0, sum_of_squares_ = 0, visible_ = 0, visible_squared_ = 0;
};

/// Finds the pairs of patches that face each other, and makes the shadow rays that measure the
/// visible fraction of their exchange. Immutable, usable from any number of threads.
class ShadowRays {
 public:
  /// The largest setting of rays of a pair; large pairs that are partly hidden get more.
  static constexpr std::uint32_t kMostRays = 256;

  /// `geometry` must outlive the object. `seed` decides which points of a pair are joined;
  /// `kernel_tolerance` is that of unoccluded_exchange_area().
  ShadowRays(const PatchGeometry& geometry, std::uint64_t seed, double kernel_tolerance)
      : geometry_(geometry), seed_(seed), kernel_tolerance_(kernel_tolerance) {}

  const PatchGeometry& geometry() const { return geometry_; }

  /// Exchange area in m² of two patches, i <= j, with nothing between them; for i == j that of a
  /// patch with itself, if it is not flat.
  double unoccluded(std::uint32_t i, std::uint32_t j) const {
    return unoccluded(i, j, kernel_tolerance_);
  }
  double unoccluded(std::uint32_t i, std::uint32_t j, double tolerance) const;

  /// Writes to `facing` the patches j >= i with `wanted`(j) that patch i exchanges light with,
  /// ascending. Patch i is among them if it is not flat.
  template <typename Wanted>
  void find_facing(std::uint32_t i, std::vector<FacingPatch>& facing, const Wanted& wanted) const;

  /// Writes `count` untraced rays for each pair of patch i to `rays`, pair by pair, each with its
  /// weight (ray_weight), between points of Sobol's sequence (sobol_blocks.h) over both patches.
  /// Rays between points that do not face each other carry no light and are not made; if a pair has
  /// fewer than `count`, the rest are void rays (is_void) that are never occluded.
  void make_rays(std::uint32_t i, std::span<const FacingPatch> facing, int count,
                 std::vector<Ray>& rays) const;

  /// The same for probe rays, which tell whether a pair is partly hidden: the first kCornerRays
  /// join the outermost points of the two patches, which an occluder with a straight edge hides or
  /// shows first.
  void make_probe_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                       std::vector<Ray>& rays) const;
  static constexpr std::uint32_t kCornerRays = 9;

  /// Whether the `rays` of a pair agree, given their transmittances `transmitted`.
  enum class Agreement : std::uint8_t { kClear, kHidden, kMixed };
  static Agreement agreement(std::span<const Ray> rays, std::span<const float> transmitted);

  /// True for a ray that only fills up the count.
  static bool is_void(const Ray& ray) { return ray_weight(ray) == 0; }

  struct Visibility {
    double part;       ///< fraction of the light of the pair that passes, [0, 1]
    double variance;   ///< of `part`
    double ray_count;  ///< number of rays of equal weight with the same certainty
  };

  /// The visibility of a pair from `rays` of make_rays and their transmittances `transmitted`.
  static Visibility visibility(std::span<const Ray> rays, std::span<const float> transmitted);

  /// Adds such rays to the estimate of a pair.
  static void add(std::span<const Ray> rays, std::span<const float> transmitted,
                  VisibilityEstimate& estimate);

  /// The kernel between the ends of a ray; 0 for a void ray.
  static double ray_weight(const Ray& ray) { return std::bit_cast<float>(ray.id); }

  /// A ray from `x` to `y` with `weight` > 0, the kernel between them.
  static Ray ray_between(const PatchPoint& x, const PatchPoint& y, float weight) {
    Ray ray;
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = x.position[axis];
      ray.direction[axis] = y.position[axis] - x.position[axis];
    }
    ray.t_near = 0;
    ray.t_far = 1;
    ray.id = std::bit_cast<std::uint32_t>(weight);
    return ray;
  }

  /// A ray that only fills up the count and is never occluded.
  static Ray void_ray();

  /// The kernel between two points as in point_kernel(), 1/m²; 0 if they do not face each other.
  static float kernel(const PatchPoint& x, const PatchPoint& y) {
    const glm::vec3 d = to_glm(y.position) - to_glm(x.position);
    const float cx = glm::dot(to_glm(x.normal), d), cy = -glm::dot(to_glm(y.normal), d);
    if (!(cx > 0 && cy > 0)) return 0;
    const float inverse = 1 / glm::dot(d, d);
    return cx * inverse * (cy * inverse) * std::numbers::inv_pi_v<float>;
  }

 private:
  std::uint64_t shift_of_pair(std::uint32_t i, std::uint32_t j) const;
  void make_pair_rays(std::uint32_t i, std::uint32_t j, std::span<Ray> rays) const;
  std::size_t make_corner_rays(std::uint32_t i, std::uint32_t j, std::span<Ray> rays) const;

  const PatchGeometry& geometry_;
  std::uint64_t seed_;
  double kernel_tolerance_;
};

inline double ShadowRays::unoccluded(std::uint32_t i, std::uint32_t j, double tolerance) const {
  const PatchBounds &a = geometry_.bounds(i), &b = geometry_.bounds(j);
  if (!a.may_face(b.centre, b.radius) || !b.may_face(a.centre, a.radius)) return 0;
  return unoccluded_exchange_area(geometry_, i, j, tolerance);
}

template <typename Wanted>
void ShadowRays::find_facing(std::uint32_t i, std::vector<FacingPatch>& facing,
                             const Wanted& wanted) const {
  facing.clear();
  for (std::uint32_t j = geometry_.bounds(i).is_flat() ? i + 1 : i; j < geometry_.patch_count();
       ++j) {
    if (!wanted(j)) continue;
    const double exchange = unoccluded(i, j);
    if (exchange > 0) facing.push_back({j, exchange});
  }
}

}  // namespace rebounce
