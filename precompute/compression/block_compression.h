#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

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

/// B_m ~ row_basis core_m column_basis^T; the column basis is empty on the diagonal, where it is
/// the row basis.
struct LowRankBlock {
  Eigen::MatrixXd row_basis;               ///< [rows][row rank], orthonormal columns
  Eigen::MatrixXd column_basis;            ///< [columns][column rank], likewise
  std::vector<Eigen::MatrixXd> couplings;  ///< [matrices], [row rank][column rank]
  double error_squared = 0;                ///< Frobenius, of all matrices together

  Eigen::Index basis_values() const { return row_basis.size() + column_basis.size(); }
  Eigen::Index vectors() const { return row_basis.cols() + column_basis.cols(); }
  Eigen::Index coupling_values() const {
    return couplings.empty()
               ? 0
               : static_cast<Eigen::Index>(couplings.size()) * couplings.front().size();
  }
};

/// What the parts of an operator take, in values of coupling matrices; may count the time of a
/// product too.
struct PartSizes {
  double basis_value = 1;
  double vector = 0;  ///< a vector of a basis beside its values: its coefficients
  double block = 32;  ///< a block beside its values: its description, and the start of its loops
};

/// What the construction minimises: error² + multiplier x size, summed over the blocks. For every
/// multiplier this is the smallest operator of its error (and the most exact one of its size) that
/// the cluster tree admits.
struct CompressionCost {
  double multiplier =
      0;  ///< squared error that one stored value of a coupling matrix or dense block is worth
  double multiplicity = 1;  ///< 2 for a block that stands for its mirror image as well
  PartSizes sizes = {};

  /// Of bases with so many values in so many vectors, and coupling matrices with so many values.
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

/// What was found among ranks up to some largest.
struct BlockAttempt {
  std::optional<LowRankBlock> block;  ///< nothing if none costs less than the limit
  double least_beyond = 0;            ///< about the least that more ranks may cost; 0: unknown
};

/// The approximation of `block` that costs the least, with bases that all matrices share.
///
/// The bases are leading singular vectors, from the Gram matrix of a small block and from a random
/// sketch of a large one: N. Halko, P. G. Martinsson and J. A. Tropp, "Finding structure with
/// randomness", 2011, algorithm 4.1, whose error is then known exactly, as the bases are
/// orthonormal. `limit` bounds the rank that is worth having and so the sketch; no rank is above
/// `largest_rank`.
///
/// Beyond it, energies of directions are taken to fall with the power of their number with which
/// they fell up to half of it.
BlockAttempt compress_block(const WideBlock& block, const CompressionCost& cost, double limit,
                            Eigen::Index largest_rank, std::uint64_t seed);

}  // namespace rebounce
