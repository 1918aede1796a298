#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/ranks.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/patches/hit_patch.h"
#include "precompute/patches/patch_model.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// The part of a patch's light that leaves through a cell of the sky.
struct EscapeToCell {
  std::uint8_t cell = 0;
  float part = 0;
};

/// Where the light of a patch goes that meets no other patch, as fractions of its light.
struct Escape {
  double sky = 0;       ///< leaves the scene
  double absorbed = 0;  ///< meets the back of a one-sided surface or a side without a patch
  /// The fraction of light that leaves through each cell of the sky, ascending by cell; cells
  /// without light are left out.
  std::vector<EscapeToCell> sky_cells{};
};

/// Memory of measure_escape. Afterwards `rays` hold the rays that were traced, and `met` the patch
/// that each ray met, or kNone.
struct EscapeScratch {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<std::uint32_t> met;
  CoincidenceScratch coincidence;
};

/// Measures the escape of patch `patch` by `ray_count` cosine-distributed rays from points spread
/// over its `triangles`, by Sobol's sequence. `shown_patch` is that of PatchModel; prefer_lit_side
/// decides which patch a ray meets.
Escape measure_escape(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                      std::span<const std::uint32_t> triangles, std::uint32_t patch,
                      const RayTracer& tracer, int ray_count, std::uint64_t seed,
                      EscapeScratch& scratch);

/// Gives all ranks what each has measured, patch by patch in turns.
void share(const Ranks& ranks, std::span<Escape> escape);

/// The escaped light of all patches: 1 minus `row_sum` [n] of F, shared among sky and absorption in
/// the proportions measured, `escape` [n].
EscapedLight share_escape(std::span<const double> row_sum, std::span<const Escape> escape);

}  // namespace rebounce
