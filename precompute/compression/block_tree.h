#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"
#include "precompute/compression/wanted_blocks.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Two clusters, by index: a square of the lower triangle that is compressed in one go.
struct BlockPiece {
  std::uint32_t row = 0, column = 0;
};

/// A part of an operator: blocks in the order of traversal and what they hold, in f32.
struct BlockPart {
  std::vector<TransferBlock> blocks;
  std::vector<float> values;
  double cost = 0;

  void append(BlockPart&& other);
};

/// The side of a piece for so many positions: 2048, and an eighth of all where that is smaller, so
/// that there are enough pieces to share.
std::uint32_t largest_piece(std::uint32_t position_count);

/// The lower triangle cut into pieces with sides of `largest` positions at most, in the order of
/// traversal.
std::vector<BlockPiece> block_pieces(const ClusterTree& tree, std::uint32_t largest);

/// Compresses one matrix at any number of multipliers.
///
/// What is minimised is error² + multiplier x size, in which the error is that of the symmetric
/// form in the Frobenius norm, with the weights of light_weights.h on both sides, or on the side
/// that light comes from where but one direction is wanted. Where the roles of the matrix want none
/// there is no block.
class BlockTreeCompressor {
 public:
  /// All that is given must outlive the object; `weights` has one entry for each cluster.
  BlockTreeCompressor(const SymmetricMatrix& matrix, const ClusterTree& tree,
                      const std::vector<ClusterWeight>& weights, const PartSizes& sizes = {})
      : matrix_(matrix),
        tree_(tree),
        weights_(weights),
        wanted_(matrix.roles(), tree),
        sizes_(sizes) {}

  /// All pieces, with sides of largest_piece at most.
  std::vector<BlockPiece> pieces() const;

  /// Whether anything of a piece is wanted.
  bool wants(const BlockPiece& piece) const { return wanted_.wanted(piece.row, piece.column); }

  /// Some pieces of the operator (f32) at a multiplier > 0. Throws Cancelled if asked to stop.
  BlockPart compress(std::span<const BlockPiece> pieces, double multiplier,
                     const Progress& progress = {}) const;

  /// The operator that all parts together are.
  HierarchicalStorage assemble(BlockPart whole) const;

 private:
  const SymmetricMatrix& matrix_;
  const ClusterTree& tree_;
  const std::vector<ClusterWeight>& weights_;
  WantedBlocks wanted_;
  PartSizes sizes_;
};

}  // namespace rebounce
