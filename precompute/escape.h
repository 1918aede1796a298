#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/precompute/form_factor_kernel.h"
#include "rebounce/precompute/patch_model.h"
#include "rebounce/runtime/ray_tracer.h"

namespace rebounce {

/// Where the light of a patch goes that no other patch gets, as parts of 1.
struct Escape {
  double sky = 0;       ///< leaves the scene
  double absorbed = 0;  ///< meets the back of a one-sided surface
};

/// Measures the escape of patch `patch` by `ray_count` cosine-distributed rays from points spread
/// over it. `rays` and `hits` are scratch; afterwards they hold what was traced.
Escape measure_escape(const PatchModel& model, const FlatTriangle& triangle, std::uint32_t patch,
                      const RayTracer& tracer, int ray_count, std::uint64_t seed,
                      std::vector<Ray>& rays, std::vector<Hit>& hits);

}  // namespace rebounce
