#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/precompute/form_factor_kernel.h"
#include "rebounce/precompute/patch_model.h"
#include "rebounce/precompute/progress.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/sky_cells.h"

namespace rebounce {

struct FormFactorSettings {
  std::uint64_t seed = 1;  ///< of the sample points; another seed is another, equally good F
  /// Shadow rays for a pair of patches to begin with; if they agree that is all. More: partly
  /// hidden pairs are noticed more often. At most 256.
  int probe_rays = 8;
  /// Shadow rays for a pair that is partly hidden; one that exchanges much gets six times as many.
  /// More: smoother penumbrae, slower. At most 256.
  int full_rays = 64;
  /// Rays per patch into its hemisphere. They measure what escapes, and what near patches of many
  /// triangles exchange; they find the pairs that probe rays misjudge. More: better row sums in
  /// open scenes, less noise between near patches.
  int hemisphere_rays = 4096;
  /// Relative error aimed at by the unoccluded kernel.
  double kernel_tolerance = 3e-4;
  /// Above 0: visibility is found for links between sets of patches (links.h) instead of for all
  /// pairs, which takes a fraction of the rays. A link may have this error: of the part of the
  /// symmetric form A^1/2 F A^-1/2 that it stands for, Frobenius, absolute. Smaller: smaller sets,
  /// more links.
  double link_epsilon = 0;
};

/// How much work form factors are worth.
enum class FormFactorQuality : std::uint8_t {
  kLow,      ///< for a first look: some three times as fast
  kDefault,  ///< analytic view factors to 0.5 %
  kHigh,     ///< to 0.1 %: some ten times slower
};

/// `settings` with what a quality decides; seed and links stay.
///
/// | quality | probe_rays | full_rays | hemisphere_rays | kernel_tolerance |
/// |---|---|---|---|---|
/// | low | 4 | 16 | 1024 | 3e-3 |
/// | default | 8 | 64 | 4096 | 3e-4 |
/// | high | 32 | 256 | 65536 | 1e-5 |
FormFactorSettings with_quality(FormFactorQuality quality, FormFactorSettings settings = {});

/// How large the correction for closure was (closure.h).
struct ClosureReport {
  double row_sum_error_before = 0;  ///< largest |sum over j of F(i,j) - target| before
  double row_sum_error_after = 0;   ///< the same after, over rows whose target is exact
  double relative_change = 0;       ///< |S' - S| / |S|, Frobenius
};

/// Where the light of patches goes that no patch gets.
struct EscapedLight {
  std::vector<float> sky_visibility;  ///< [n] fraction of a patch's light that leaves the scene
  std::vector<float> absorbed;        ///< [n] fraction that meets back faces; with the row sum of F
                                      ///< the three add up to 1
  SkyCells sky_cells;                 ///< by which of its cells patches see the sky
};

struct FormFactors : EscapedLight {
  ExchangeMatrix exchange;
  ClosureReport closure;
  std::uint64_t ray_count = 0;
  std::uint64_t pair_count = 0;  ///< pairs of patches that face each other
};

/// Finds the form factors of every pair of patches: the exact exchange of the unoccluded patches
/// times the kernel-weighted part of shadow rays that get through (form_factor_kernel.h), joined
/// with what hemisphere rays count, which alone speak for near patches of many triangles; corrected
/// so that reciprocity and closure hold together (closure.h).
///
/// `tracer` holds the first surface_count triangles of model.mesh. Rows are shared out among OpenMP
/// threads; the bits do not depend on how many. Throws Cancelled when `progress` says so.
FormFactors compute_form_factors(const PatchModel& model, const RayTracer& tracer,
                                 const FormFactorSettings& settings = {},
                                 const Progress& progress = {});

struct FormFactorForecast {
  double seconds = 0;  ///< with the threads that there are
  double ray_count = 0;
};

/// What compute_form_factors will take for all pairs, whatever settings.link_epsilon is: by a
/// sample of them, in about a hundredth of the time. Rough. Throws Cancelled when `progress` says
/// so.
FormFactorForecast forecast_form_factors(const PatchModel& model, const RayTracer& tracer,
                                         const FormFactorSettings& settings = {},
                                         const Progress& progress = {});

}  // namespace rebounce
