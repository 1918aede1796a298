#include "precompute/compression/residual_ranks.h"

#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The squared error that a value of a residual must remove, in multipliers (lab/042).
constexpr double kResidualWorth = 1;

constexpr double kLargestByte = 127;

struct BasisEnd {
  const MatrixXd& basis;
  const ClusterWeight* weight;
};

/// Inner products of the vectors of a basis under its weight.
MatrixXd weighted_gram(const BasisEnd& end) {
  MatrixXd weighted = end.basis;
  if (end.weight != nullptr) end.weight->weigh_rows(weighted);
  return weighted.transpose() * weighted;
}

/// The residual rank of the end whose vectors belong to the rows of `couplings`; `other` is the
/// other end.
Index residual_rank_of(const BasisEnd& end, const BasisEnd& other,
                       const std::vector<MatrixXd>& couplings, const CompressionCost& cost) {
  const auto size = static_cast<double>(end.basis.rows());
  const MatrixXd gram = weighted_gram(other);
  const double to_other = end.weight != nullptr ? end.weight->squared_norm() : 0;
  const double from_other = other.weight != nullptr ? size : 0;
  return worthwhile_residual_rank(end.basis, cost.multiplier, [&](Index r) {
    double effect = 0;
    for (const MatrixXd& coupling : couplings) {
      effect += to_other * coupling.row(r).squaredNorm() +
                from_other * coupling.row(r).dot(gram * coupling.row(r).transpose());
    }
    return effect;
  });
}

/// The mean squared norm of the vectors of a basis under its weight; 0 without one.
double weighted_size(const BasisEnd& end) {
  if (end.weight == nullptr || end.basis.cols() == 0) return 0;
  return weighted_gram(end).trace() / static_cast<double>(end.basis.cols());
}

}  // namespace

Index worthwhile_residual_rank(const MatrixXd& vectors, double multiplier,
                               const std::function<double(Index)>& effect) {
  const double worth = kResidualWorth * multiplier * static_cast<double>(vectors.rows());
  Index count = 0;
  for (Index k = 0; k < vectors.cols(); ++k) {
    const double step = vectors.col(k).cwiseAbs().maxCoeff() / kLargestByte;
    if (step * step / 12 * effect(k) > worth) count = k + 1;
  }
  return count;
}

ResidualRanks find_residual_ranks(const LowRankBlock& block, const BlockWeights& weights,
                                  const CompressionCost& cost) {
  const BasisEnd row{block.row_basis, weights.row};
  const BasisEnd column{block.on_diagonal ? block.row_basis : block.column_basis, weights.column};
  ResidualRanks ranks;
  ranks.row = residual_rank_of(row, column, block.couplings, cost);
  if (block.on_diagonal) {
    ranks.column = ranks.row;
    return ranks;
  }
  std::vector<MatrixXd> transposed;
  for (const MatrixXd& coupling : block.couplings) transposed.push_back(coupling.transpose());
  ranks.column = residual_rank_of(column, row, transposed, cost);
  return ranks;
}

double coupling_step(const LowRankBlock& block, const BlockWeights& weights,
                     const CompressionCost& cost) {
  // Rounding to a step is an error of step² / 12 in the mean, and a bit less makes it four times
  // as large. A unit of size has the bits of a half (lab/079, lab/146).
  constexpr double kBitsOfUnit = 16;
  const bool on_diagonal = block.column_basis.cols() == 0;
  const double effect = weighted_size({block.row_basis, weights.row}) +
                        (on_diagonal ? 0 : weighted_size({block.column_basis, weights.column}));
  if (effect == 0) return 0;
  return std::sqrt(12 * cost.multiplier / (kBitsOfUnit * 2 * std::numbers::ln2 * effect));
}

}  // namespace rebounce
