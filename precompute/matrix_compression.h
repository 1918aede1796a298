#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rebounce/precompute/hierarchical_transfer.h"
#include "symmetric_matrix.h"

namespace rebounce {

/// Compresses `matrix` as compress_transfer does. `patches` are those of the matrix.
HierarchicalOperator::Storage compress_matrix(const SymmetricMatrix& matrix,
                                              const PatchTable& patches,
                                              std::span<const std::vector<Float3>> shaping,
                                              double price, const Progress& progress = {});

/// Compresses `matrix` to a tolerance as build_hierarchical_transfer does.
std::shared_ptr<const HierarchicalOperator> compress_to_tolerance(
    const SymmetricMatrix& matrix, const PatchTable& patches, const FittingLights& lights,
    const HierarchicalSettings& settings, const Progress& progress = {});

}  // namespace rebounce
