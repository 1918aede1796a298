#pragma once

#include "precompute/build/phase_clock.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Finds what patches exchange as pairs, into data.exchange, and into data.links if these are to be
/// stored, and records it in `report`. `decided`: settings that leave nothing open. Returns what
/// leaves the scene. Throws Cancelled if asked to stop.
EscapedLight find_pairs(const PatchModel& model, const RayTracer& tracer,
                        const BuildSettings& decided, TransferData& data, BuildReport& report,
                        PhaseClock& clock);

}  // namespace rebounce
