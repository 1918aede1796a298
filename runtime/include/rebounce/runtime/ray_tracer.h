#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "rebounce/transfer/types.h"

namespace rebounce {

/// A ray from `origin` along `direction` (any length; t counts in units of it). Laid out as Embree
/// reads it, so that a stream of rays is traced where it lies.
struct alignas(16) Ray {
  Float3 origin;
  float t_near;
  Float3 direction;
  float time = 0;
  float t_far;
  std::uint32_t mask = 0xFFFFFFFFU;  // Debian's Embree is built with ray masks on
  std::uint32_t id = 0;
  std::uint32_t flags = 0;
};

struct Hit {
  float t = 0;
  std::uint32_t triangle = kNone;  ///< kNone: nothing was hit
  float u = 0, v = 0;              ///< barycentric weights of the second and third vertex
  bool front = false;              ///< the front side was hit
};

/// Triangles that rays can be traced against. Immutable, usable from any number of threads.
class RayTracer {
 public:
  /// Builds the acceleration structure over all `triangle`s. Indices must be in range.
  /// Throws Error if Embree refuses (out of memory).
  RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle);
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Traces shadow rays; afterwards `rays[k].t_far` is negative where ray k met something.
  /// `rays` must be 16-byte aligned (std::vector<Ray> is).
  void occluded(std::span<Ray> rays) const;

  /// Finds the nearest hit of every ray. hits.size() == rays.size().
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True if a shadow ray given to RayTracer::occluded met something.
inline bool is_occluded(const Ray& ray) { return ray.t_far < 0; }

/// A point moved off its surface along the geometric normal by just more than the rounding error
/// of its coordinates, so that a ray that leaves it does not meet that surface.
Float3 offset_point(const Float3& point, const Float3& geometric_normal);

}  // namespace rebounce
