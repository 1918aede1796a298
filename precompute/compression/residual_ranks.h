#pragma once

#include <Eigen/Core>
#include <functional>

#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"

namespace rebounce {

/// Which light a block passes on: the weights of its row and of its column positions; null where
/// errors there are not weighed.
struct BlockWeights {
  const ClusterWeight *row = nullptr, *column = nullptr;
};

/// Of the first vectors of each end, how many are to have residuals in 8 bits.
struct ResidualRanks {
  Eigen::Index row = 0, column = 0;
};

/// The number of columns up to the last whose residual is worth its values: where what bytes leave
/// of them is an error above multiplier x rows. `effect(column)` is the squared error that an error
/// of one in each of its entries would be if these were independent.
Eigen::Index worthwhile_residual_rank(const Eigen::MatrixXd& vectors, double multiplier,
                                      const std::function<double(Eigen::Index)>& effect);

/// What bytes leave of a vector of a basis is an error of the block in proportion to the entries
/// that go with the vector. A vector gets a residual where that error is worth more than the
/// residual's values, and so do those before it. It is the sum of what it does to the light of
/// either direction, weighed where the light comes from. Bases are orthonormal, without the
/// weights.
ResidualRanks find_residual_ranks(const LowRankBlock& block, const BlockWeights& weights,
                                  const CompressionCost& cost);

}  // namespace rebounce
