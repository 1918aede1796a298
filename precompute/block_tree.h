#pragma once

#include <cstdint>
#include <vector>

#include "cluster_tree.h"
#include "light_weights.h"
#include "rebounce/precompute/progress.h"
#include "rebounce/transfer/hierarchical_operator.h"
#include "symmetric_matrix.h"

namespace rebounce {

/// Compresses one matrix at any number of prices.
///
/// What is minimised is error² + price x values, in which the error is that of the
/// symmetric form in the Frobenius norm, with the weights of light_weights.h on both sides.
class BlockTreeCompressor {
 public:
  /// All that is given must outlive the object; `weights` has one entry for each cluster.
  BlockTreeCompressor(const SymmetricMatrix& matrix, const ClusterTree& tree,
                      const std::vector<ClusterWeight>& weights);

  /// The operator (f32) at a price > 0. Throws Cancelled if asked to stop.
  HierarchicalOperator::Storage compress(double price, const Progress& progress = {}) const;

 private:
  /// Two clusters, by index: a square of the lower triangle that is compressed in one go.
  struct Piece {
    std::uint32_t row, column;
  };

  void add_pieces(std::uint32_t row, std::uint32_t column, std::uint32_t largest);

  const SymmetricMatrix& matrix_;
  const ClusterTree& tree_;
  const std::vector<ClusterWeight>& weights_;
  std::vector<Piece> pieces_;  ///< in the order of traversal
};

}  // namespace rebounce
