#pragma once

// The core of direct light: lamps, points, and the shadows between them.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// A point of a surface that receives light.
struct LitPoint {
  glm::vec3 position;  ///< metres, moved off the surface (RayTracer::offset_point)
  glm::vec3 normal;    ///< unit
};

/// The largest number of sample points of a lamp with a surface per receiving point.
inline constexpr int kMaxAreaLightSamples = 64;

/// Adds the shadowed light of lamps at points to sums. Shadow rays are collected and traced in
/// batches. The light that gets through is added in the order of the calls, so the sums have the
/// same bits for any batch size. Does not allocate.
class LampShadows {
 public:
  /// `tracer` and `irradiance`, the sums in lx per unit of intensity, must outlive the object.
  LampShadows(const RayTracer& tracer, std::span<float> irradiance)
      : tracer_(tracer), irradiance_(irradiance) {}

  /// Adds to sum number `sum` the part of `irradiance` that gets through to `position` from a lamp,
  /// or one place of it, in the direction of `light`. `position` is moved off the surface.
  void add_ray(const glm::vec3& position, const UnitLight& light, float irradiance,
               std::size_t sum);

  /// Adds `weight` times the irradiance at `point` from `lamp`, which has a surface, to sum number
  /// `sum`. `places` are its sample points in [0, 1)^2, 1 to kMaxAreaLightSamples of them. The
  /// unshadowed irradiance is exact; the rays give the visible fraction of it, each weighted by its
  /// own contribution (E. Heitz, S. Hill, M. McGuire, "Combining analytic direct illumination and
  /// stochastic shadows", 2018).
  void add_surface(const PreparedLight& lamp, const LitPoint& point,
                   std::span<const glm::vec2> places, float weight, std::size_t sum);

  /// Traces the collected rays. Then the sums are complete.
  void flush();

 private:
  static constexpr std::size_t kBatch = 64;  // shadow rays traced at a time

  const RayTracer& tracer_;
  std::span<float> irradiance_;
  std::size_t count_ = 0;
  std::array<Ray, kBatch> rays_;
  std::array<float, kBatch> transmitted_;
  std::array<std::uint32_t, kBatch> sum_;
  std::array<float, kBatch> carried_;
};

}  // namespace rebounce
