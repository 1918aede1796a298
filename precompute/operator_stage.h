#pragma once

#include "phase_clock.h"
#include "rebounce/precompute/build.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// The last stage of a build: makes the operator of `data`, whose patches, mesh and form factors
/// are there, measures it, and records it all. `decided`: settings that leave nothing open. Throws
/// Error if the operator fails its own check, Cancelled if asked to stop.
void make_operator(const RayTracer& tracer, const BuildSettings& decided, TransferData& data,
                   BuildReport& report, PhaseClock& clock);

}  // namespace rebounce
