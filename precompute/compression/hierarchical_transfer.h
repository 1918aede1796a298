#pragma once

#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/base/precision.h"
#include "transfer/data/patch_roles.h"
#include "transfer/file/transfer_data.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/dense_operator.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Compresses a dense operator (f32) so coarsely that an error of one in the square of the
/// Frobenius norm of Yhat, with the weights that the `training` lights give (light_weights.h), is
/// worth 1 / `multiplier` stored values. A uniform light is always among them. With `roles`, only
/// what the light of sources does to receivers is looked at and stored. Throws Cancelled if asked
/// to stop.
HierarchicalStorage compress_transfer(const DenseOperator& dense, const PatchTable& patches,
                                      std::span<const std::vector<Float3>> training,
                                      double multiplier, const Progress& progress = {},
                                      const PatchRoles& roles = {});

/// The smallest such operator whose errors under the validation lights are well within the
/// tolerance in the mean, and within three times of it at most, found in a few rounds. From round
/// to round, training lights that came out badly get more weight. If no operator is within, the
/// most exact one: measure it. With `roles`, the errors are those at receivers, of what sources
/// give off.
std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const PatchRoles& roles = {});

}  // namespace rebounce
