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

/// The multiplier at which searches begin, for a tolerance > 0 and a number of patches > 0.
double initial_multiplier(double tolerance, std::size_t patch_count);

/// Compresses `matrix` to a tolerance as build_hierarchical_transfer does. `checkpoint`, made for
/// these arguments, keeps the results of each round; parts that it holds are reused. The bits are
/// the same with and without it.
std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, FittingLights lights,
    const HierarchicalSettings& settings, const Progress& progress = {},
    const BlockCheckpoint& checkpoint = {});

}  // namespace rebounce
