#pragma once

#include <cstdint>

#include "rebounce/precompute/build.h"
#include "rebounce/precompute/patch_model.h"

namespace rebounce {

/// What form factors and operator of these patches will take.
CostEstimate estimate_cost(const PatchModel& model, const BuildSettings& settings);

/// Throws Error if that is above `limit_bytes`, or above half of the machine's memory if that is 0.
void refuse_if_too_large(const CostEstimate& estimate, std::uint64_t limit_bytes,
                         std::size_t triangle_count);

}  // namespace rebounce
