#pragma once

#include <cstddef>
#include <cstdint>

namespace rebounce {

/// Rows and columns of a tile of a DenseOperator.
inline constexpr std::size_t kDenseTile = 64;

/// What the values of a HierarchicalOperator and the kernels that multiply them agree on.
struct HierarchicalFormat {
  /// Clusters begin and end at multiples of this many positions.
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kPadding = 16;

  /// In half precision, dense entries and coupling matrices are stored times this, so that small
  /// ones stay normal numbers; bases are stored as they are. With orthonormal bases no coupling
  /// matrix has an entry above the norm of Yhat, 1 / (1 - reflectance): up to 0.99, the most that
  /// patches have, all of them fit. Those of an equilibrated K are made to: encode_values.
  static constexpr float kHalfScale = 512;

  /// In 8 bits, a basis holds its vectors times numbers of their own such that their largest
  /// entries are +-127; coupling matrices are divided by them, with this for 1 at each end.
  static constexpr float kByteScale = 128;

  /// Vectors that bytes are too coarse for have a residual: what rounding left of them, times
  /// this, as bytes again. Those of a basis follow its vectors, in their order.
  static constexpr float kResidualScale = 254;

  /// In 16 bits likewise: the largest are +-kLargestShort, and kShortScale stands for 1. So few
  /// that sums of 128 products with such numbers fit 32 bits.
  static constexpr std::int16_t kLargestShort = 4095;
  static constexpr float kShortScale = 4096;

  /// Of the scales of positions.
  static constexpr int kLargestExponent = 24;

  /// Of bases in 16 bits, so many ranks are kept together, and so many positions.
  static constexpr std::uint32_t kRankGroup = 4, kStrip = 64;

  /// Positions with the padding that makes them whole vectors: n rounded up to kAlignment.
  static constexpr std::size_t position_count(std::size_t patch_count) {
    return (patch_count + kAlignment - 1) / kAlignment * kAlignment;
  }
};

/// A rectangle of the symmetric matrix Yhat in cluster order. Either it lies on the diagonal, its
/// rows and columns the same, or all of its columns come before its rows; then it stands for its
/// transpose too.
///
/// Large blocks are of low rank over *cluster coefficients* instead of positions: the light of some
/// positions in a basis that all blocks over them share. A block of kClusterBasis is such a basis.
/// Cluster coefficients are numbered after the positions, and the rows and the columns of a
/// low-rank block each are of one kind.
struct TransferBlock {
  /// Of kClusterBasis the rows are positions and the columns the cluster coefficients that they
  /// have, in the order of the blocks.
  enum class Kind : std::uint32_t { kDense = 0, kLowRank = 1, kClusterBasis = 2 };

  std::uint32_t row_begin = 0, row_count = 0;        ///< positions, multiples of kAlignment
  std::uint32_t column_begin = 0, column_count = 0;  ///< likewise
  Kind kind = Kind::kDense;
  /// Of a low-rank block; 0 for a dense one; of cluster coefficients as many as columns, and 0.
  std::uint32_t row_rank = 0, column_rank = 0;
  /// So many of the first vectors of a basis are sums of two in 8 bits, which alone are too coarse
  /// for them: see kResidualScale. In f32 they are told but not used; in f16 and 16 bits 0.
  std::uint32_t row_residual_rank = 0, column_residual_rank = 0;

  bool on_diagonal() const { return row_begin == column_begin; }

  /// Values that it takes up, for `matrix_count` distinct channels, without residuals.
  std::uint64_t value_count(std::uint32_t matrix_count) const {
    const std::uint64_t rows = row_count, columns = column_count;
    if (kind == Kind::kDense) return matrix_count * rows * columns;
    const std::uint64_t column_basis = on_diagonal() ? 0 : columns * column_rank;
    return rows * row_rank + column_basis +
           std::uint64_t{matrix_count} * row_rank * std::uint64_t{column_rank};
  }
};

}  // namespace rebounce
