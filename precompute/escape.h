#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/precompute/patch_model.h"
#include "rebounce/runtime/patch_points.h"
#include "rebounce/runtime/ray_tracer.h"

namespace rebounce {

/// Where the light of a patch goes that no other patch gets, as parts of 1.
struct Escape {
  double sky = 0;       ///< leaves the scene
  double absorbed = 0;  ///< meets the back of a one-sided surface, or a side without a patch
};

/// Room for the work of measure_escape; afterwards `rays` and `hits` hold what was traced.
struct EscapeScratch {
  std::vector<PatchPoint> points;
  std::vector<Ray> rays;
  std::vector<Hit> hits;
};

/// Measures the escape of patch `patch` by `ray_count` cosine-distributed rays from points spread
/// over its `triangles`. A side that another covers stands for that one.
Escape measure_escape(const PatchModel& model, std::span<const std::uint32_t> triangles,
                      std::uint32_t patch, const RayTracer& tracer, int ray_count,
                      std::uint64_t seed, EscapeScratch& scratch);

/// The patch whose light shows where `hit` is, kNone if none does.
std::uint32_t patch_at(const PatchModel& model, const Hit& hit);

}  // namespace rebounce
