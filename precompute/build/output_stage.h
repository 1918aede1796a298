#pragma once

#include <cstdint>
#include <span>

#include "precompute/build/phase_clock.h"
#include "precompute/patches/patch_model.h"
#include "rebounce/build_report.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Places the lightmap that `settings` ask for and adds its warnings to `report`.
Lightmap make_lightmap(const PatchModel& model, const BuildSettings& settings, BuildReport& report);

/// Adds to `data` what brings the light of patches to where it is shown: weights of vertices, and
/// the probes and surface harmonics that `settings` ask for. `shown_patch` [t] is that of the
/// PatchModel. Throws Error as the functions of precompute/outputs do, Cancelled if asked to stop.
void make_outputs(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                  const BuildSettings& settings, TransferData& data, BuildReport& report,
                  PhaseClock& clock);

/// Adds to `data` what needs its operator: the irradiance from emitters, and the rows of receivers
/// that `settings` ask for; what vertices show without rows goes to `report`. Throws as
/// irradiance_from_emitters and make_receiver_rows do.
void make_outputs_of_operator(std::span<const std::uint32_t> shown_patch, const RayTracer& tracer,
                              const BuildSettings& settings, TransferData& data,
                              BuildReport& report, PhaseClock& clock);

}  // namespace rebounce
