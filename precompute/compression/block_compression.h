#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "precompute/compression/structured_block.h"

namespace rebounce {

/// One block of each distinct channel side by side, [rows][matrices x columns].
struct WideBlock {
  Eigen::MatrixXd entries;
  Eigen::Index matrix_count = 1;
  bool on_diagonal = false;

  Eigen::Index rows() const { return entries.rows(); }
  Eigen::Index columns() const { return entries.cols() / matrix_count; }
  auto matrix(Eigen::Index m) const { return entries.middleCols(m * columns(), columns()); }
};

/// B_m ~ row_basis coupling_m column_basis^T. On the diagonal the column basis is empty: it equals
/// the row basis.
struct LowRankBlock {
  Eigen::MatrixXd row_basis;               ///< [rows][row rank], orthonormal columns
  Eigen::MatrixXd column_basis;            ///< [columns][column rank], orthonormal columns
  bool on_diagonal = false;                ///< the row basis is that of the columns too
  std::vector<Eigen::MatrixXd> couplings;  ///< [matrices], [row rank][column rank]
  double error_squared = 0;                ///< squared Frobenius norm, all matrices together

  Eigen::Index basis_values() const { return row_basis.size() + column_basis.size(); }
  Eigen::Index vectors() const { return row_basis.cols() + column_basis.cols(); }
  Eigen::Index coupling_values() const {
    return couplings.empty()
               ? 0
               : static_cast<Eigen::Index>(couplings.size()) * couplings.front().size();
  }
};

/// The sizes of the parts of an operator, in values of coupling matrices. They may include the time
/// of a product.
struct PartSizes {
  double basis_value = 1;
  double vector = 0;  ///< a vector of a basis, beside its values: its coefficients
  double block = 32;  ///< a block, beside its values: its description and the start of its loops
};

/// The objective that construction minimises: error² + multiplier x size, summed over the blocks,
/// with a Lagrange multiplier as in rate-distortion optimisation. For every multiplier the minimum
/// is the smallest operator of its error, and the most exact operator of its size, that the cluster
/// tree admits.
struct CompressionCost {
  /// The squared error that is worth one stored value of a coupling matrix or dense block.
  double multiplier = 0;
  double multiplicity = 1;  ///< 2 for a block that also stands for its mirror image
  PartSizes sizes = {};

  /// The size of bases with `basis_values` values in `vectors` vectors, and coupling matrices with
  /// `coupling_values` values.
  double size(Eigen::Index basis_values, Eigen::Index vectors, Eigen::Index coupling_values) const {
    return sizes.basis_value * static_cast<double>(basis_values) +
           sizes.vector * static_cast<double>(vectors) + static_cast<double>(coupling_values);
  }
  double total(double error_squared, double size) const {
    return multiplicity * error_squared + multiplier * size;
  }
  double of(const LowRankBlock& block) const {
    return total(block.error_squared,
                 size(block.basis_values(), block.vectors(), block.coupling_values()));
  }
};

/// The result of trying ranks up to a limit.
struct BlockAttempt {
  std::optional<LowRankBlock> block;  ///< empty if none costs less than the limit
  double least_beyond = 0;            ///< estimate of the least cost of higher ranks; 0: unknown
};

/// The approximation of `block` with the least cost, with bases that all matrices share.
///
/// The bases are leading singular vectors: from the Gram matrix of a small block, from a random
/// sketch of a large one (N. Halko, P. G. Martinsson and J. A. Tropp, "Finding structure with
/// randomness", 2011, algorithm 4.1). The error is known exactly, because the bases are
/// orthonormal. `limit` is the cost that the block must stay below; it bounds the rank that is
/// worth having, and with it the sketch. No rank is above `largest_rank`.
///
/// The cost of higher ranks is estimated from how energies fall: the energies of directions follow
/// a power of their number, fitted to the first half of the directions.
BlockAttempt compress_block(const WideBlock& block, const CompressionCost& cost, double limit,
                            Eigen::Index largest_rank, std::uint64_t seed);

/// The same from a sketch alone, for blocks whose sides are several times `largest_rank`. The error
/// is estimated.
BlockAttempt compress_block(const StructuredBlock& block, const CompressionCost& cost, double limit,
                            Eigen::Index largest_rank, std::uint64_t seed);

}  // namespace rebounce
