#pragma once

#include <cstdint>

#include "rebounce/precompute/build.h"
#include "rebounce/precompute/patch_model.h"

namespace rebounce {

/// What the build may take: as it was set, or half of the machine's memory.
std::uint64_t memory_limit_bytes(const BuildSettings& settings);

/// What form factors and operator of these patches will take, by pairs whatever the settings say.
CostEstimate estimate_cost_of_pairs(const PatchModel& model, const BuildSettings& settings);

/// The same of what settings.form_factor_kind, which is no longer open, says.
CostEstimate estimate_cost(const PatchModel& model, const BuildSettings& settings);

/// Throws Error if an estimate is above `limit_bytes`.
void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count);

}  // namespace rebounce
