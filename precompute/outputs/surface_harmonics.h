#pragma once

// Finds the directions from which light arrives at patches.

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

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
