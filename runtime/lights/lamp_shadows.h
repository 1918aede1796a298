#pragma once

// The core of direct light: a lamp, points, and what is in between.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// A point of a surface at which light is looked for.
struct LitPoint {
  glm::vec3 position;  ///< metres, moved off the surface (RayTracer::offset_point)
  glm::vec3 normal;    ///< unit
};

/// Most places of a lamp with a surface that a point looks at.
inline constexpr int kMaxAreaLightSamples = 64;

/// Adds the light of lamps at points to sums, shadowed. Shadow rays are collected and traced
/// together; what gets through is added in the order of the calls, so that the sums have the same
/// bits wherever the batches end. Does not allocate.
class LampShadows {
 public:
  /// `tracer` and `irradiance`, the sums in lx per unit of intensity, must outlive the object.
  LampShadows(const RayTracer& tracer, std::span<float> irradiance)
      : tracer_(tracer), irradiance_(irradiance) {}

  /// Adds `weight` times the irradiance at `point` from `lamp` to sum number `sum`. Of a lamp with
  /// a surface the point looks at `places` in [0, 1)^2, from 1 to kMaxAreaLightSamples; others
  /// ignore them. What would arrive from a surface is known exactly, and the rays find which part
  /// of it does, each counting by what its place contributes (E. Heitz, S. Hill, M. McGuire,
  /// "Combining analytic direct illumination and stochastic shadows", 2018).
  void add(const PreparedLight& lamp, const LitPoint& point, std::span<const glm::vec2> places,
           float weight, std::size_t sum);

  /// Traces what has been collected. The sums are complete after it.
  void flush();

 private:
  static constexpr std::size_t kBatch = 64;  // shadow rays that are traced together

  void add_surface(const PreparedLight& lamp, const LitPoint& point,
                   std::span<const glm::vec2> places, float weight, std::size_t sum);
  void add_ray(const LitPoint& point, const UnitLight& light, float irradiance, std::size_t sum);

  const RayTracer& tracer_;
  std::span<float> irradiance_;
  std::size_t count_ = 0;
  std::array<Ray, kBatch> rays_;
  std::array<float, kBatch> transmitted_;
  std::array<std::uint32_t, kBatch> sum_;
  std::array<float, kBatch> carried_;
};

}  // namespace rebounce
