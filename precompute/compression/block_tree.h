#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/base/progress.h"
#include "precompute/base/ranks.h"
#include "precompute/base/symmetric_matrix.h"
#include "precompute/compression/block_compression.h"
#include "precompute/compression/light_weights.h"
#include "precompute/compression/wanted_blocks.h"
#include "precompute/patches/cluster_tree.h"
#include "transfer/format/hierarchical_storage.h"

namespace rebounce {

/// Two clusters, by index: a piece of the lower triangle that is compressed at once.
struct BlockPiece {
  std::uint32_t row = 0, column = 0;
};

/// A part of an operator: its blocks in the order of traversal, and their values in f32.
struct BlockPart {
  std::vector<TransferBlock> blocks;
  std::vector<float> values;
  double cost = 0;

  void append(const BlockPart& other);
};

/// The parts one after the other, with room for what assemble adds. Each ends once it is copied, so
/// that they take little more memory than the whole.
BlockPart joined(std::vector<BlockPart> parts);

/// Gives all ranks the parts that each has made, part by part in turns.
void share(const Ranks& ranks, std::span<BlockPart> parts);

/// The side of a piece for a number of positions: at most 2048, and at most an eighth of the
/// positions where possible, so that there are enough pieces to share among threads.
std::uint32_t largest_piece(std::uint32_t position_count);

/// The lower triangle cut into pieces with sides of at most `largest` positions, in the order of
/// traversal.
std::vector<BlockPiece> block_pieces(const ClusterTree& tree, std::uint32_t largest);

/// Compresses one matrix for any number of Lagrange multipliers.
///
/// The objective is error² + multiplier x size. The error is that of the symmetric form in the
/// Frobenius norm, with the weights of light_weights.h on both sides; where only one direction is
/// wanted, on the side that light comes from. There are no blocks where the roles of the matrix
/// want none.
class BlockTreeCompressor {
 public:
  /// All arguments must outlive the object; `weights` has one entry for each cluster.
  BlockTreeCompressor(const SymmetricMatrix& matrix, const ClusterTree& tree,
                      const std::vector<ClusterWeight>& weights, const PartSizes& sizes = {})
      : matrix_(matrix),
        tree_(tree),
        weights_(weights),
        wanted_(matrix.roles(), tree),
        sizes_(sizes) {}

  /// All pieces, with sides of at most largest_piece.
  std::vector<BlockPiece> pieces() const;

  /// True if any entry of a piece is wanted.
  bool wants(const BlockPiece& piece) const { return wanted_.wanted(piece.row, piece.column); }

  /// Compresses pieces of the operator (f32) at a multiplier > 0. Ranks share them. Throws
  /// Cancelled if asked to stop.
  BlockPart compress(std::span<const BlockPiece> pieces, double multiplier,
                     const Progress& progress = {}) const;

  /// The operator made of `whole`, all parts together.
  HierarchicalStorage assemble(BlockPart whole) const;

 private:
  const SymmetricMatrix& matrix_;
  const ClusterTree& tree_;
  const std::vector<ClusterWeight>& weights_;
  WantedBlocks wanted_;
  PartSizes sizes_;
};

}  // namespace rebounce
