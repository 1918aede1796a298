#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/patches/patch_model.h"
#include "precompute/patches/seen_patch.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Where the light of a patch goes that no other patch gets, as parts of 1.
struct Escape {
  double sky = 0;       ///< leaves the scene
  double absorbed = 0;  ///< meets the back of a one-sided surface, or a side without a patch
  /// What leaves by cells of the sky, ascending, without those by which nothing does.
  std::vector<std::pair<std::uint8_t, float>> sky_cells{};
};

/// Room for the work of measure_escape; afterwards `rays` hold what was traced, and `met` which
/// patch's light each of them met: kNone if none's.
struct EscapeScratch {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<std::uint32_t> met;
  CoincidenceScratch coincidence;
};

/// Measures the escape of patch `patch` by `ray_count` cosine-distributed rays from points spread
/// over its `triangles`, by Sobol's sequence; what they meet is what prefer_lit_side says.
Escape measure_escape(const PatchModel& model, std::span<const std::uint32_t> triangles,
                      std::uint32_t patch, const RayTracer& tracer, int ray_count,
                      std::uint64_t seed, EscapeScratch& scratch);

/// What the rows of F, which add up to `row_sum` [n], leave of 1 is what escapes; its parts are
/// shared as they were measured, `escape` [n].
EscapedLight share_escape(std::span<const double> row_sum, std::span<const Escape> escape);

}  // namespace rebounce
