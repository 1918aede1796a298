#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/runtime/patch_points.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

struct DirectLightingSettings {
  /// Points of a patch at which lamps are looked at. More: softer, truer shadow borders; time grows
  /// in proportion. At least 1.
  int points_per_patch = 8;
};

/// Direct irradiance of the patches of one scene, with shadows.
///
/// The points are spread over each patch once and stay where they are, so that a light that moves
/// does not flicker. Holds scratch: one object per thread that lights.
class DirectLighting {
 public:
  /// `data` and `tracer` (the first surface_count triangles of data.mesh) must outlive the object.
  DirectLighting(const TransferData& data, const RayTracer& tracer,
                 const DirectLightingSettings& settings = {});

  /// Writes the irradiance [n] in lx that arrives straight from `lights` and `sky`. Does not
  /// allocate. The same bits for any number of OpenMP threads.
  void compute(std::span<const Light> lights, const Sky& sky, std::span<Float3> direct_irradiance);

 private:
  struct ShadowRay {
    std::uint32_t patch;
    Float3 irradiance;
  };

  void add_light(const Light& light, std::size_t begin, std::size_t end,
                 std::span<Float3> direct_irradiance);

  const TransferData& data_;
  const RayTracer& tracer_;
  std::size_t points_per_patch_;
  std::vector<PatchPoint> points_;        ///< [n][points_per_patch], moved off the surface
  std::vector<Ray> rays_;                 ///< [n][points_per_patch] scratch
  std::vector<ShadowRay> contributions_;  ///< [n][points_per_patch] scratch, beside rays_
};

}  // namespace rebounce
