#pragma once

#include <Eigen/Core>
#include <functional>

#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"

namespace rebounce {

/// The weights of the light at the rows and columns of a block; null where errors have no weight.
struct BlockWeights {
  const ClusterWeight *row = nullptr, *column = nullptr;
};

/// The residual rank of each end of a block: how many of its first vectors have residuals in 8
/// bits.
struct ResidualRanks {
  Eigen::Index row = 0, column = 0;
};

/// The number of vectors up to the last whose residual is worth its values: rounding it to 8 bits
/// alone gives an error above multiplier x rows. `effect(column)` is the squared error of the
/// operator for independent errors of one in each entry of the vector.
Eigen::Index worthwhile_residual_rank(const Eigen::MatrixXd& vectors, double multiplier,
                                      const std::function<double(Eigen::Index)>& effect);

/// Finds the residual ranks of a block. Rounding a vector of a basis to 8 bits is an error of the
/// block, in proportion to the entries of the coupling matrix that belong to the vector. A vector
/// gets a residual, and so do those before it, if that error costs more than the values of the
/// residual. The error is summed over both directions of light, weighted where the light comes
/// from. The bases are orthonormal, without weights.
ResidualRanks find_residual_ranks(const LowRankBlock& block, const BlockWeights& weights,
                                  const CompressionCost& cost);

/// The step to which the entries of the coupling matrix of a block are rounded: a bit more of each
/// entry costs as much as the error that it removes. The error is summed as that of
/// find_residual_ranks, and the same is asked of the bases.
double coupling_step(const LowRankBlock& block, const BlockWeights& weights,
                     const CompressionCost& cost);

}  // namespace rebounce
