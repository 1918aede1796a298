#include "precompute/compression/basis_remainders.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// What a value of a remainder has to remove, in prices of a value of a core. Measured:
// notes/operator.md.
constexpr double kRemainderWorth = 1;

constexpr double kLargestByte = 127;

struct BasisEnd {
  const MatrixXd& basis;
  const ClusterWeight* weight;
};

/// Inner products of the vectors of a basis under its weight.
MatrixXd weighted_gram(const BasisEnd& end) {
  MatrixXd weighted = end.basis;
  if (end.weight != nullptr) end.weight->put_left(weighted);
  return weighted.transpose() * weighted;
}

/// For the end whose vectors are the rows of `cores`. `other` is the other end.
Index remainder_count(const BasisEnd& end, const BasisEnd& other,
                      const std::vector<MatrixXd>& cores, const CompressionCost& cost) {
  const auto size = static_cast<double>(end.basis.rows());
  const MatrixXd gram = weighted_gram(other);
  const double to_other = end.weight != nullptr ? end.weight->squared_norm() : 0;
  const double from_other = other.weight != nullptr ? size : 0;
  return worthwhile_remainders(end.basis, cost.price, [&](Index r) {
    double effect = 0;
    for (const MatrixXd& core : cores) {
      effect += to_other * core.row(r).squaredNorm() +
                from_other * core.row(r).dot(gram * core.row(r).transpose());
    }
    return effect;
  });
}

}  // namespace

Index worthwhile_remainders(const MatrixXd& vectors, double price,
                            const std::function<double(Index)>& effect) {
  const double worth = kRemainderWorth * price * static_cast<double>(vectors.rows());
  Index count = 0;
  for (Index k = 0; k < vectors.cols(); ++k) {
    const double step = vectors.col(k).cwiseAbs().maxCoeff() / kLargestByte;
    if (step * step / 12 * effect(k) > worth) count = k + 1;
  }
  return count;
}

BasisRemainders find_remainders(const LowRankBlock& block, const BlockWeights& weights,
                                const CompressionCost& cost) {
  const bool on_diagonal = block.column_basis.cols() == 0 && block.row_basis.cols() > 0;
  const BasisEnd row{block.row_basis, weights.row};
  const BasisEnd column{on_diagonal ? block.row_basis : block.column_basis, weights.column};
  BasisRemainders remainders;
  remainders.row = remainder_count(row, column, block.cores, cost);
  if (on_diagonal) {
    remainders.column = remainders.row;
    return remainders;
  }
  std::vector<MatrixXd> transposed;
  for (const MatrixXd& core : block.cores) transposed.push_back(core.transpose());
  remainders.column = remainder_count(column, row, transposed, cost);
  return remainders;
}

}  // namespace rebounce
