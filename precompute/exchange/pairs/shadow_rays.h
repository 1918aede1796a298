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

/// A patch that another one would exchange light with.
struct FacingPatch {
  std::uint32_t patch;
  double unoccluded;  ///< exchange area in m² with nothing between
};

/// What weighted rays say of how much light gets through.
class VisibilityEstimate {
 public:
  /// A ray of `weight` >= 0 of whose light the part `transmitted` in [0, 1] gets through.
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

  bool is_empty() const { return sum_ <= 0; }  ///< no ray weighs anything: nothing below holds
  double part() const { return visible_ / sum_; }

  /// Variance of what single rays find.
  double spread() const { return std::max(0.0, visible_squared_ / sum_ - part() * part()); }

  /// As sure as that many rays of equal weight (Kish's effective sample size).
  double effective_count() const { return sum_ * sum_ / sum_of_squares_; }
  double variance() const { return spread() / effective_count(); }  ///< of part()

 private:
  double sum_ = 0, sum_of_squares_ = 0, visible_ = 0, visible_squared_ = 0;
};

/// The pairs of patches that face each other, and the shadow rays that find out how much of a
/// pair's exchange gets through. Immutable, usable from any number of threads.
class ShadowRays {
 public:
  /// The most rays that a pair can be asked to have.
  static constexpr std::uint32_t kMostRays = 256;

  /// `geometry` must outlive it. `seed` decides which points of a pair are joined;
  /// `kernel_tolerance` is that of unoccluded_exchange_area().
  ShadowRays(const PatchGeometry& geometry, std::uint64_t seed, double kernel_tolerance)
      : geometry_(geometry), seed_(seed), kernel_tolerance_(kernel_tolerance) {}

  const PatchGeometry& geometry() const { return geometry_; }

  /// Exchange area in m² of two patches with nothing between them, i <= j; of a patch with itself
  /// if it is not flat.
  double unoccluded(std::uint32_t i, std::uint32_t j) const {
    return unoccluded(i, j, kernel_tolerance_);
  }
  double unoccluded(std::uint32_t i, std::uint32_t j, double tolerance) const;

  /// Writes to `facing` the patches j >= i that patch i would exchange light with, if `wanted`(j),
  /// in ascending order. Patch i itself is among them if it is not flat.
  template <typename Wanted>
  void find_facing(std::uint32_t i, std::vector<FacingPatch>& facing, const Wanted& wanted) const;

  /// Writes to `rays` `count` untraced rays for each pair of patch i, one pair after the other,
  /// each with its weight (ray_weight), between points of Sobol's sequence (sobol_blocks.h) over
  /// both patches. Rays between points that do not face each other carry no
  /// light and are not made; where a pair has fewer the rest are never occluded and void (is_void).
  void make_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                 std::vector<Ray>& rays) const;

  /// The same for rays that are to tell whether a pair is partly hidden: the first kCornerRays join
  /// the outermost points of the two, which what has a straight edge hides or shows first.
  void make_probe_rays(std::uint32_t i, const std::vector<FacingPatch>& facing, int count,
                       std::vector<Ray>& rays) const;
  static constexpr std::uint32_t kCornerRays = 9;

  /// What the `rays` of a pair agree on, whose transmittances are `transmitted`.
  enum class Agreement : std::uint8_t { kClear, kHidden, kMixed };
  static Agreement agreement(std::span<const Ray> rays, std::span<const float> transmitted);

  /// True for a ray that stands for none.
  static bool is_void(const Ray& ray) { return ray_weight(ray) == 0; }

  struct Visibility {
    double part;       ///< of the pair's light that gets through, [0, 1]
    double variance;   ///< of `part`
    double ray_count;  ///< rays of equal weight that would tell as much
  };

  /// What the `rays` of a pair that make_rays made and their transmittances `transmitted` say of
  /// it.
  static Visibility visibility(std::span<const Ray> rays, std::span<const float> transmitted);

  /// Adds the same rays to what is known of the pair.
  static void add(std::span<const Ray> rays, std::span<const float> transmitted,
                  VisibilityEstimate& estimate);

  /// The kernel between the ends of a ray; 0 of a void one.
  static double ray_weight(const Ray& ray) { return std::bit_cast<float>(ray.id); }

  /// A ray from `x` to `y`, of `weight` > 0: the kernel between them.
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

  /// One that stands for none and is never occluded.
  static Ray void_ray();

  /// The kernel between two points as point_kernel() has it, 1/m²; 0 if they do not face each
  /// other.
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
