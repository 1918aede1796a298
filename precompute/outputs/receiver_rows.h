#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "precompute/base/progress.h"
#include "precompute/outputs/row_receivers.h"
#include "rebounce/build_settings.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Rows, and why they were made.
struct MadeReceiverRows {
  ReceiverRows rows;
  /// The relative error of the light that all show without rows, root mean square over the surface,
  /// median over the lights; if settings.least_error is more than 0 and any may have rows.
  std::optional<double> error_without;
};

/// Throws Error if a setting is out of its range.
void check_receiver_rows(const ReceiverRowSettings& settings);

/// Finds rows of `receivers` by rays and stores what they add to the reconstruction weights, by
/// sets of patches (receiver_sets.h); receivers to which they add less than the tolerance get none.
/// There are none at all if the light without them errs by less than settings.least_error.
/// `data` needs its weights and an operator, which lights the scene for the choice of sets.
/// `shown_patch` [t] is that of PatchModel. Throws Error if a setting is out of range or there is
/// no operator, Cancelled if asked to stop.
MadeReceiverRows make_receiver_rows(const TransferData& data,
                                    std::span<const std::uint32_t> shown_patch,
                                    const RowReceivers& receivers, const RayTracer& tracer,
                                    const ReceiverRowSettings& settings, std::uint64_t seed,
                                    const Progress& progress = {});

}  // namespace rebounce
