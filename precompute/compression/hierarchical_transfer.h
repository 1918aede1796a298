#pragma once

#include <memory>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/lights/fitting_lights.h"
#include "rebounce/scene_data.h"
#include "transfer/base/precision.h"
#include "transfer/file/transfer_data.h"
#include "transfer/format/hierarchical_storage.h"
#include "transfer/operator/dense_operator.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// Compresses a dense operator (f32) at one Lagrange multiplier: a squared error of `multiplier` is
/// worth one stored value. The error is that of Yhat in the Frobenius norm, with the weights that
/// the `training` lights give (light_weights.h). A uniform light always is among the training
/// lights. With `roles`, only the transfer from sources to receivers is read and stored. Throws
/// Cancelled if asked to stop.
HierarchicalStorage compress_transfer(const DenseOperator& dense, const PatchTable& patches,
                                      std::span<const std::vector<Float3>> training,
                                      double multiplier, const Progress& progress = {},
                                      const PatchRoles& roles = {});

/// The smallest operator whose errors under the validation lights stay within the tolerance: in the
/// mean with a margin, and for each light within three times the tolerance. It is found in a few
/// rounds; from round to round, training lights with large errors get more weight. If no operator
/// is within the tolerance, the result is the most exact one: measure it. With `roles`, errors are
/// those at receivers, for light of sources.
std::shared_ptr<const HierarchicalOperator> build_hierarchical_transfer(
    const DenseOperator& dense, const PatchTable& patches, FittingLights lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const PatchRoles& roles = {});

}  // namespace rebounce
