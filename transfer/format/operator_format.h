#pragma once

#include <cstddef>
#include <cstdint>

namespace rebounce {

/// Rows and columns of a tile of a DenseOperator.
inline constexpr std::size_t kDenseTile = 64;

/// The constants that the values of a HierarchicalOperator and its kernels share.
struct HierarchicalFormat {
  /// Clusters begin and end at multiples of this many positions.
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kPadding = 16;

  /// In half precision, dense entries and coupling matrices are stored times this factor, so that
  /// small entries stay normal numbers. Bases are stored as they are. With orthonormal bases no
  /// entry of a coupling matrix exceeds the norm of Yhat, 1 / (1 - reflectance). Patches have a
  /// reflectance of at most 0.99, so all of them fit. encode_values makes those of an equilibrated
  /// K fit.
  static constexpr float kHalfScale = 512;

  /// The integer that stands for 1 in 8-bit bases. Each vector of a basis is scaled so that its
  /// largest entry is +-127; the scales are multiplied into the coupling matrices.
  static constexpr float kByteScale = 128;

  /// Vectors for which 8 bits are too coarse have a residual: the rounding error times this factor,
  /// again in 8 bits. The residuals of a basis follow its vectors, in their order.
  static constexpr float kResidualScale = 254;

  /// Bound of the exponents of position scales.
  static constexpr int kLargestExponent = 24;

  /// Ranks and positions that integer bases interleave (lab/038). A group of ranks by a group of
  /// positions is what one instruction multiplies.
  static constexpr std::uint32_t kRankGroup = 4, kPositionGroup = 4, kStrip = 64;

  /// The size of a stored TransferBlock.
  static constexpr std::size_t kBlockBytes = 36;

  /// The number of positions: n rounded up to kAlignment.
  static constexpr std::size_t position_count(std::size_t patch_count) {
    return (patch_count + kAlignment - 1) / kAlignment * kAlignment;
  }
};

/// A rectangle of the symmetric matrix Yhat in cluster order. It either lies on the diagonal, with
/// equal rows and columns, or all of its columns come before its rows; then it stands for its
/// transpose too.
///
/// Large low-rank blocks are over *cluster coefficients* instead of positions: the light of a
/// cluster in a basis that all blocks over the cluster share. A block of kClusterBasis is such a
/// basis. Cluster coefficients are numbered after the positions. The rows of a low-rank block are
/// either all positions or all cluster coefficients, and so are its columns.
struct TransferBlock {
  /// The rows of a kClusterBasis block are positions. Its columns are the cluster coefficients of
  /// these positions, numbered in the order of the blocks.
  enum class Kind : std::uint32_t { kDense = 0, kLowRank = 1, kClusterBasis = 2 };

  std::uint32_t row_begin = 0, row_count = 0;        ///< positions, multiples of kAlignment
  std::uint32_t column_begin = 0, column_count = 0;  ///< likewise
  Kind kind = Kind::kDense;
  /// Ranks of a low-rank block. A dense block has 0 and 0, a cluster basis column_count and 0.
  std::uint32_t row_rank = 0, column_rank = 0;
  /// The number of leading basis vectors that have a residual in 8 bits (kResidualScale). In f32
  /// the numbers are kept but not used; in f16 they are 0.
  std::uint32_t row_residual_rank = 0, column_residual_rank = 0;
  /// The step to which entries of the coupling matrix between orthonormal bases may be rounded
  /// beside integer bases; 0: as fine as 16 bits allow. It guides encode_values and is in no file.
  float coupling_step = 0;

  bool on_diagonal() const { return row_begin == column_begin; }

  /// The number of values for `matrix_count` distinct matrices, without residuals.
  std::uint64_t value_count(std::uint32_t matrix_count) const {
    const std::uint64_t rows = row_count, columns = column_count;
    if (kind == Kind::kDense) return matrix_count * rows * columns;
    const std::uint64_t column_basis = on_diagonal() ? 0 : columns * column_rank;
    return rows * row_rank + column_basis +
           std::uint64_t{matrix_count} * row_rank * std::uint64_t{column_rank};
  }
};

}  // namespace rebounce
