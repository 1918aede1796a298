#pragma once

#include "precompute/build/phase_clock.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

// What patches exchange: found, and recorded in `report`. `decided`: settings that leave nothing
// open. Both return what leaves the scene, and throw Cancelled if asked to stop.

/// Into data.exchange, and into data.links if they are to be stored.
EscapedLight find_pairs(const PatchModel& model, const RayTracer& tracer,
                        const BuildSettings& decided, TransferData& data, BuildReport& report,
                        PhaseClock& clock);

/// Into data.links alone.
EscapedLight find_links(const PatchModel& model, const RayTracer& tracer,
                        const BuildSettings& decided, TransferData& data, BuildReport& report,
                        PhaseClock& clock);

}  // namespace rebounce
