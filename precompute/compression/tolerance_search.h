#pragma once

#include <cstddef>
#include <memory>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/compression/block_checkpoint.h"
#include "precompute/compression/hierarchical_settings.h"
#include "precompute/lights/fitting_lights.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {

/// The multiplier at which searches begin, for one value per patch.
double initial_multiplier(double tolerance, std::size_t patch_count);

/// Compresses `matrix` to a tolerance as build_hierarchical_transfer does. What each round of the
/// search does is kept in `checkpoint`, made for all that is given here, and taken from there: the
/// bits are the same.
std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const BlockCheckpoint& checkpoint = {});

}  // namespace rebounce
