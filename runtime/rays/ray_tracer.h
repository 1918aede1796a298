#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/opacity_maps.h"
#include "transfer/file/transfer_data.h"

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
  std::uint32_t id = 0;              // the caller's own
  std::uint32_t flags = 0;
};

struct Hit {
  float t = 0;
  std::uint32_t triangle = kNone;  ///< kNone: nothing was hit
  float u = 0, v = 0;              ///< barycentric weights of the second and third vertex
  bool front = false;              ///< the front side was hit
};

/// What a ray does at a triangle that has an opacity map.
enum class Passage : std::uint8_t {
  kHoles,  ///< it goes on where the map is 0, stops where it is kOpaque, and in between stops as
           ///< often as the opacity says: by a hash of ray and triangle, the same every time
  kSolid,  ///< it stops: the triangle counts as whole
};

/// How finely transmittance() looks at an opacity map.
enum class PassageDetail : std::uint8_t {
  kTriangle,       ///< the mean of each triangle: free of noise
  kMicroTriangle,  ///< the opacity where the ray meets it
};

/// Triangles that rays can be traced against. Immutable, usable from any number of threads.
class RayTracer {
 public:
  /// Builds the acceleration structure over all `triangle`s. Indices must be in range.
  /// `opacity` says which of them light passes through; it may be of more triangles, and is copied.
  /// Throws Error if Embree refuses (out of memory).
  RayTracer(std::span<const Float3> position, std::span<const Uint3> triangle,
            const OpacityMaps& opacity = {});
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  /// Traces shadow rays; afterwards `rays[k].t_far` is negative where ray k met something.
  /// `rays` must be 16-byte aligned (std::vector<Ray> is).
  void occluded(std::span<Ray> rays) const;

  /// Writes to `part` [rays] how much of the light along each ray gets through, [0, 1]: 0 where it
  /// meets an opaque triangle, else the product over those with maps. Afterwards is_occluded()
  /// tells which rays met an opaque one.
  void transmittance(std::span<Ray> rays, PassageDetail detail, std::span<float> part) const;

  /// Finds the nearest hit of every ray. hits.size() == rays.size().
  void intersect(std::span<const Ray> rays, std::span<Hit> hits,
                 Passage passage = Passage::kHoles) const;

  /// Appends every hit of `ray` to `hits`, in no particular order of distance but always the same.
  void intersect_all(const Ray& ray, std::vector<Hit>& hits) const;

  /// A point moved off its surface along the unit `geometric_normal`, so that a ray that begins or
  /// ends there does not meet that surface: by offset_distance().
  Float3 offset_point(const Float3& point, const Float3& geometric_normal) const;

  /// 2^-18 of the largest coordinate of the scene. The rounding errors of a ray's origin, of its
  /// end and of the plane equation in between are each some 2^-24 of the coordinates they are found
  /// from, however near to zero the point itself is: this is some tens of them, 40 micrometres in a
  /// room of ten metres.
  float offset_distance() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The offset_distance() of a tracer over these positions.
float ray_offset_distance(std::span<const Float3> position);

/// The tracer of what is shown: of the first surface_count triangles of `mesh`.
RayTracer make_surface_tracer(const DisplayMesh& mesh);

/// True if a shadow ray given to RayTracer::occluded met something.
inline bool is_occluded(const Ray& ray) {
  return ray.t_far < 0;
}

}  // namespace rebounce
