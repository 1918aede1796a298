#pragma once

// Where light probes are, and what they see.

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

struct ProbeSettings {
  Uint3 grid{0, 0, 0};  ///< probes along x, y and z; zeros: as many as `spacing` asks for
  float spacing = 0;    ///< metres between probes; 0: there are none unless `grid` says so
  /// Rays of each probe. More: truer, in proportion to the number at best; the file and the time of
  /// a frame grow until all that is seen is hit. At least 64.
  int ray_count = 2048;
};

/// The middles of the cells of a grid over the box around `mesh`. Throws Error where that is more
/// than 65,536. `settings` asks for probes.
LightProbes place_probes(const DisplayMesh& mesh, const ProbeSettings& settings);

/// Fills the map of `probes`, of which positions and grid are given, by rays spread evenly over the
/// sphere. A probe of whose rays more than a quarter meet the backs of one-sided surfaces is not
/// valid, as one within a wall does (Z. Majercik et al., "Dynamic diffuse global illumination with
/// ray-traced irradiance fields", 2019, whose test it is). `shown_patch` [t] is that of PatchModel,
/// `tracer` holds the surface of data.mesh. Throws Cancelled.
void trace_probes(const TransferData& data, std::span<const std::uint32_t> shown_patch,
                  const RayTracer& tracer, const ProbeSettings& settings, LightProbes& probes,
                  const Progress& progress = {});

}  // namespace rebounce
