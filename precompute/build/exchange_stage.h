#pragma once

#include "precompute/build/phase_clock.h"
#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/exchange_results.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/data/patch_roles.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Finds what patches exchange as pairs, into data.exchange, and into data.links if these are to be
/// stored, and records it in `report`. `decided`: settings that leave nothing open. Returns what
/// leaves the scene. Throws Cancelled if asked to stop.
EscapedLight find_pairs(const PatchModel& model, const RayTracer& tracer,
                        const BuildSettings& decided, TransferData& data, BuildReport& report,
                        PhaseClock& clock);

/// Links, and what finding them has given.
struct FoundLinks : LinkBuild {
  /// Those chosen again from these (fit_links), if they were judged by them; or empty.
  FormFactorLinks fewer;
};

/// Finds what patches exchange as links, and records it in `report`. `decided`: settings that leave
/// nothing open.
///
/// With `judged`, rays tell what the light of the links is off by under some point lights
/// (error_of_links). Above the part of the tolerance that links may take, they are made again with
/// a smaller link_epsilon, which goes to `decided`, at most twice and only as far as the memory
/// limit allows and it helps. The patches and the mesh of `model` are lent to `data` meanwhile.
///
/// Throws Cancelled if asked to stop.
FoundLinks find_links(PatchModel& model, const RayTracer& tracer, const PatchRoles& roles,
                      bool judged, BuildSettings& decided, TransferData& data, BuildReport& report,
                      PhaseClock& clock);

/// Forecasts the number of links, from a sample. Throws Cancelled if asked to stop.
std::size_t forecast_links(const PatchModel& model, const RayTracer& tracer,
                           const BuildSettings& decided, PhaseClock& clock);

}  // namespace rebounce
