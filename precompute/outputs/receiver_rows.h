#pragma once

#include <cstdint>
#include <span>

#include "precompute/base/progress.h"
#include "precompute/outputs/row_receivers.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Finds rows of `receivers` by rays and stores what they add to the reconstruction weights, by
/// sets of patches (receiver_sets.h); receivers to which they add less than the tolerance get none.
/// `data` needs its weights and an operator, which lights the scene for the choice of sets.
/// `shown_patch` [t] is that of PatchModel. Throws Error if a setting is out of range or there is
/// no operator, Cancelled if asked to stop.
ReceiverRows make_receiver_rows(const TransferData& data,
                                std::span<const std::uint32_t> shown_patch,
                                const RowReceivers& receivers, const RayTracer& tracer,
                                const ReceiverRowSettings& settings, std::uint64_t seed,
                                const Progress& progress = {});

}  // namespace rebounce
