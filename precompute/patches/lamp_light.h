#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "precompute/import/scene.h"
#include "precompute/patches/triangle_sides.h"
#include "runtime/rays/ray_tracer.h"
#include "runtime/rays/triangle.h"

namespace rebounce {

/// The direct light of the scene's own lamps and emitting surfaces, by which patches are made finer
/// where it varies: near lamps and at the borders of shadows. P. S. Heckbert, "Simulating global
/// illumination using adaptive meshing" (1991), and D. Lischinski, F. Tampieri, D. P. Greenberg,
/// "Discontinuity meshing for accurate radiosity" (1992), put the edges of the mesh there; here
/// triangles are bisected until they are small beside such a border, and patches end where merging
/// them costs most.
class LampLight {
 public:
  /// `weight` is SubdivisionSettings::lamp_weight.
  LampLight(const Scene& scene, double weight);

  /// True if no lamp has a part in the patches.
  bool empty() const { return lights_.empty() && emitters_.empty(); }

  /// Finds the root mean square of the light over the lit sides of `scene`, which is the unit of
  /// all that follows. If no light arrives, or more than numbers hold, the object is
  /// empty afterwards.
  void measure(const Scene& scene, std::span<const TriangleSides> sides, const RayTracer& tracer);

  /// Bisects triangles on which the light varies until they add little to the deviation from the
  /// means of patches of `patch_size` metres (refinement.h); `sides` [t] are those of the
  /// triangles.
  std::vector<std::uint32_t> refine(Scene& scene, std::span<const TriangleSides> sides,
                                    const RayTracer& tracer, double patch_size,
                                    std::size_t most_added) const;

  /// The mean light on the front of a triangle, from `count` of its points, in mean patch sizes:
  /// `weight` times the light in its unit. 0 if empty.
  double feature(const TriangleCorners& front, const RayTracer& tracer, std::uint32_t count) const;

 private:
  /// A point that stands for a part of the emitting surfaces.
  struct Emitter {
    glm::vec3 position, normal;
    float candela = 0;       ///< along the normal, mean of the channels
    float near_squared = 0;  ///< m²: closer than this the part is no point
    bool double_sided = false;
  };

  /// The light that arrives along some rays if nothing is in between.
  struct LightRays {
    std::vector<Ray> ray;             ///< its id is the number of the point where it begins
    std::vector<double> illuminance;  ///< lx, mean of the channels, times cosine
  };

  struct Moments {
    double mean = 0, variance = 0;
  };
  Moments light_on(const TriangleCorners& front, const RayTracer& tracer,
                   std::uint32_t count) const;
  double variance_on(const TriangleCorners& corners, const TriangleSides& sides,
                     const RayTracer& tracer) const;

  void place_emitters(const Scene& scene);
  void add_lamp(const Light& lamp, const Float3& point, const glm::vec3& normal, std::uint32_t id,
                LightRays& rays) const;
  void add_emitter(const Emitter& emitter, const Float3& point, const glm::vec3& normal,
                   std::uint32_t id, LightRays& rays) const;

  std::vector<Light> lights_;
  std::vector<Emitter> emitters_;
  double scale_;  ///< from lx to the feature
};

}  // namespace rebounce
