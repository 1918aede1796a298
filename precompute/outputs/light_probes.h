#pragma once

// Places light probes and finds what they see.

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The centres of the cells of a grid over the box around `mesh`. Throws Error if there are more
/// than 65,536. `settings` must ask for probes.
LightProbes place_probes(const DisplayMesh& mesh, const ProbeSettings& settings);

/// Fills the map of `probes`, whose positions and grid are set, by rays spread evenly over the
/// sphere. A probe is not valid if more than a quarter of its rays meet the backs of one-sided
/// surfaces: it lies inside a wall (the test is that of Z. Majercik et al., "Dynamic diffuse global
/// illumination with ray-traced irradiance fields", 2019). `shown_patch` [t] is that of PatchModel,
/// `tracer` holds the surface of data.mesh. Throws Cancelled if asked to stop.
void trace_probes(const TransferData& data, std::span<const std::uint32_t> shown_patch,
                  const RayTracer& tracer, const ProbeSettings& settings, LightProbes& probes,
                  const Progress& progress = {});

}  // namespace rebounce
