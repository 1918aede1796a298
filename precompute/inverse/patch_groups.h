#pragma once

#include <cstdint>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"

namespace rebounce {

/// Groups of patches that exchange most of their light among each other: the rooms of a house, for
/// instance, between which little light passes. `form_factors` are G. Returns the group of each
/// patch, [n], the largest first and kMostPatchGroups at most; nothing if all are of one group.
/// Throws Cancelled if asked to stop.
///
/// Light that is spread over a group leaves it slowly: each group has an eigenvector of F near 1,
/// with F scaled so that rows sum to 1. The eigenvectors are found by subspace iteration; patches
/// are told apart in them by a pivoted QR decomposition (A. Damle, V. Minden and L. Ying, "Simple,
/// direct and efficient multi-way spectral clustering", 2019).
std::vector<std::uint8_t> group_patches(const SymmetricMatrix& form_factors,
                                        const Progress& progress = {});

}  // namespace rebounce
