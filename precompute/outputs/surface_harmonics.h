#pragma once

// Finds the directions from which light arrives at patches.

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

struct SurfaceHarmonicSettings {
  /// Rays of each patch, at least 16; 0: no harmonics. The noise falls with the square root of the
  /// number; a patch has at most as many entries, of 17 or 20 bytes, as rays.
  int ray_count = 0;
  std::uint64_t seed = 1;  ///< of the sample points
};

/// Finds the harmonics of the light of every patch by rays spread evenly over the hemispheres above
/// points of the patch. `shown_patch` [t] is that of PatchModel, `tracer` holds the surface of
/// data.mesh. The bits do not depend on the number of OpenMP threads. Throws Error if a setting is
/// out of range or the patches see too much for a file, Cancelled if `progress` asks to stop.
SurfaceHarmonics trace_surface_harmonics(const TransferData& data,
                                         std::span<const std::uint32_t> shown_patch,
                                         const RayTracer& tracer,
                                         const SurfaceHarmonicSettings& settings,
                                         const Progress& progress = {});

}  // namespace rebounce
