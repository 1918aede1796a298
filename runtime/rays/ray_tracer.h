#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "rebounce/scene_data.h"
#include "rebounce/types.h"
#include "runtime/rays/ray_offset.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A ray from `origin` along `direction` (any length; t counts in units of it). It has Embree's
/// layout, so that a stream of rays is traced in place.
struct alignas(16) Ray {
  Float3 origin;
  float t_near;
  Float3 direction;
  float time = 0;
  float t_far;
  std::uint32_t mask = 0xFFFFFFFFU;  // Debian's Embree compares ray masks
  std::uint32_t id = 0;              // free for the caller
  std::uint32_t flags = 0;
};

struct Hit {
  float t = 0;
  std::uint32_t triangle = kNone;  ///< kNone: no hit
  float u = 0, v = 0;              ///< barycentric weights of the second and third vertex
  bool front = false;              ///< whether the ray hit the front side
};

/// What a ray does at a triangle that has an opacity map.
enum class Passage : std::uint8_t {
  kHoles,  ///< it continues where the map is 0 and stops where it is kOpaque; in between it stops
           ///< with the probability of the opacity, by a hash of ray and triangle that never
           ///< changes
  kSolid,  ///< it stops: the triangle is treated as opaque
};

/// The resolution at which transmittance() reads an opacity map.
enum class PassageDetail : std::uint8_t {
  kTriangle,       ///< the mean of each triangle: free of noise
  kMicroTriangle,  ///< the opacity at the hit point
};

/// Triangles for ray tracing: by Embree, or by a TriangleTree in builds without it. Immutable; any
/// number of threads may use it.
class RayTracer {
 public:
  /// Builds the acceleration structure over all triangles. Indices must be in range. `opacity` may
  /// cover more triangles than that; it is copied. Throws Error if Embree fails,
  /// std::bad_alloc if it is out of memory.
  RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle,
            const OpacityMaps& opacity = {});
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Traces shadow rays. Afterwards `rays[k].t_far` is negative if ray k hit something
  /// (is_occluded). `rays` must be 16-byte aligned; std::vector<Ray> is.
  void occluded(std::span<Ray> rays) const;

  /// Writes to `part` [rays] the fraction of light that gets through along each ray, in [0, 1]: 0
  /// if it hits an opaque triangle, otherwise the product over triangles with maps. Afterwards
  /// is_occluded() tells which rays hit an opaque triangle.
  void transmittance(std::span<Ray> rays, PassageDetail detail, std::span<float> part) const;

  /// Finds the nearest hit of every ray. hits.size() == rays.size().
  void intersect(std::span<const Ray> rays, std::span<Hit> hits,
                 Passage passage = Passage::kHoles) const;

  /// Appends every hit of `ray` to `hits`, in a deterministic order that is not by distance. A
  /// triangle may come twice.
  void intersect_all(const Ray& ray, std::vector<Hit>& hits) const;

  /// `point` moved by offset_distance() along the unit `geometric_normal`, so that a ray that
  /// starts or ends there does not hit its own surface.
  Float3 offset_point(const Float3& point, const Float3& geometric_normal) const {
    return offset_along(point, geometric_normal, offset_distance());
  }

  /// The ray_offset_distance() of the scene, in metres.
  float offset_distance() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A tracer over the first surface_count triangles of `mesh`.
inline RayTracer make_surface_tracer(const DisplayMesh& mesh) {
  return {mesh.position, std::span(mesh.triangle).first(mesh.surface_count()), mesh.opacity};
}

/// True if RayTracer::occluded or transmittance found an opaque triangle along the ray.
inline bool is_occluded(const Ray& ray) {
  return ray.t_far < 0;
}

}  // namespace rebounce
