#include "precompute/compression/block_compression.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "precompute/base/eigenvectors.h"
#include "precompute/base/orthonormal_columns.h"
#include "precompute/base/random_signs.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Columns of a sketch beyond the wanted rank; Halko et al. advise 5 to 10.
constexpr Index kOversampling = 8;

// Directions that have at least this part of the energy of a block are found in single precision
// (lab/149).
constexpr double kSinglePrecision = 1e-11;

// In a block with more rows than this, ranks above a quarter of the rows are not tried.
constexpr Index kLargeBlock = 128;

/// Orthonormal directions in descending order of their energy.
struct Spectrum {
  MatrixXd directions;          ///< one to a column
  std::vector<double> missing;  ///< [k] energy of the whole minus that of the first k
};

Spectrum descending(const Eigenvectors& ascending) {
  Spectrum spectrum;
  const Eigen::VectorXd& energies = ascending.values;
  const Index count = energies.size();
  spectrum.directions = ascending.vectors.rowwise().reverse();
  spectrum.missing.assign(static_cast<std::size_t>(count) + 1, 0);
  for (Index k = count; k-- > 0;) {
    spectrum.missing[k] = spectrum.missing[k + 1] + std::max(0.0, energies[count - 1 - k]);
  }
  return spectrum;
}

Spectrum gram_spectrum(const MatrixXd& a) {
  MatrixXd gram = MatrixXd::Zero(a.rows(), a.rows());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(a);
  return descending(eigenvectors(gram));
}

/// What the choice of ranks needs to know of a block.
struct Shape {
  Index rows, columns, matrix_count;
  bool on_diagonal;

  explicit Shape(const WideBlock& block)
      : rows(block.rows()),
        columns(block.columns()),
        matrix_count(block.matrix_count),
        on_diagonal(block.on_diagonal) {}
  explicit Shape(const StructuredBlock& block)
      : rows(block.rows()),
        columns(block.columns()),
        matrix_count(block.matrix_count()),
        on_diagonal(block.on_diagonal()) {}
};

enum class Digits { kSingle, kDouble };

/// The block times some columns.
MatrixXd times(const WideBlock& block, const MatrixXf& columns, Digits digits) {
  if (digits == Digits::kDouble) return block.entries * columns.cast<double>();
  return MatrixXf(block.entries.cast<float>() * columns).cast<double>();
}

/// The leading left singular vectors of a block.
class RowSpectrum : public Spectrum {
 public:
  /// No more than `largest_rank` are wanted. A direction is worth having for the energy `price`.
  RowSpectrum(const WideBlock& block, Index largest_rank, double price, std::uint64_t seed) {
    if (2 * (largest_rank + kOversampling) < block.rows()) {
      const double energy = block.entries.squaredNorm();
      const Digits digits = price > kSinglePrecision * energy ? Digits::kSingle : Digits::kDouble;
      const MatrixXd range =
          orthonormal_columns(times(block, signs(Shape(block), largest_rank, seed), digits));
      MatrixXd block_in_range = range.transpose() * block.entries;
      const double lost = std::max(0.0, energy - block_in_range.squaredNorm());
      find_directions(range, std::move(block_in_range), lost);
    } else {
      in_range_ = block.entries;
      static_cast<Spectrum&>(*this) = gram_spectrum(in_range_);
      in_range_directions_ = directions;
    }
  }

  RowSpectrum(const StructuredBlock& block, Index largest_rank, double /*price*/,
              std::uint64_t seed) {
    const MatrixXd range =
        orthonormal_columns(block.times(signs(Shape(block), largest_rank, seed)));
    find_directions(range, block.in_directions(range), block.energy_beside(range));
  }

  /// The block in the first `rank` directions, [rank][matrices x columns].
  MatrixXd project(Index rank) const {
    return in_range_directions_.leftCols(rank).transpose() * in_range_;
  }

 private:
  static MatrixXf signs(const Shape& shape, Index largest_rank, std::uint64_t seed) {
    return random_signs(shape.matrix_count * shape.columns, largest_rank + kOversampling, seed);
  }

  /// The directions in a range, beside which the block has the energy `lost`.
  void find_directions(const MatrixXd& range, MatrixXd block_in_range, double lost) {
    in_range_ = std::move(block_in_range);
    static_cast<Spectrum&>(*this) = gram_spectrum(in_range_);
    for (double& energy_missing : missing) energy_missing += lost;
    in_range_directions_ = std::move(directions);
    directions = range * in_range_directions_;
  }

  MatrixXd in_range_;             ///< the block in the basis of its range, [range][columns]
  MatrixXd in_range_directions_;  ///< the directions in that basis
};

/// Exact right singular vectors of `a`.
Spectrum right_spectrum(const MatrixXd& a) {
  if (a.cols() <= a.rows()) return gram_spectrum(a.transpose());
  Spectrum left = gram_spectrum(a);
  MatrixXd right = a.transpose() * left.directions;
  right.colwise().normalize();
  left.directions = std::move(right);
  return left;
}

/// The number of directions, at most `largest`, with the least total cost. Rank k takes `size(k)`;
/// a unit of missing energy counts `weight` times.
template <typename Size>
Index cheapest_rank(const Spectrum& spectrum, Index largest, const CompressionCost& cost,
                    double weight, const Size& size) {
  Index best = 0;
  double least = cost.total(weight * spectrum.missing[0], 0);
  const Index end = std::min<Index>(largest, spectrum.directions.cols());
  for (Index k = 1; k <= end; ++k) {
    const double total = cost.total(weight * spectrum.missing[k], size(k));
    if (total < least) {
      least = total;
      best = k;
    }
  }
  return best;
}

/// The size of the bases for each rank.
double size_per_rank(const Shape& block, const CompressionCost& cost) {
  return block.on_diagonal ? cost.size(block.rows, 1, 0)
                           : cost.size(block.rows + block.columns, 2, 0);
}

/// Larger ranks are not tried.
Index largest_rank_of(const Shape& block) {
  return block.rows > kLargeBlock ? block.rows / 4 : block.rows;
}

Index largest_worthwhile_rank(const Shape& block, const CompressionCost& cost, double limit) {
  const double affordable = limit / (cost.multiplier * size_per_rank(block, cost));
  const Index largest = largest_rank_of(block);
  return affordable < static_cast<double>(largest) ? static_cast<Index>(affordable) : largest;
}

/// The least cost of ranks above `seen`, estimated from the energies of the row directions alone:
/// those of the columns and the coupling matrices are left out. 0 for blocks that are fast to try.
double least_cost_beyond(const Shape& block, const Spectrum& rows, Index seen,
                         const CompressionCost& cost) {
  constexpr Index kFewest = 8;
  if (block.rows <= kLargeBlock || seen < kFewest) return 0;
  const auto energy = [&](Index first, Index last) {
    return (rows.missing[first] - rows.missing[last]) / static_cast<double>(last - first);
  };
  // The energies of the later directions of a sketch are too low and the energy missing from the
  // first is too high, but on average by no more than this factor: Halko et al., theorem 10.5.
  const Index half = seen / 2, quarter = half / 2;
  const double excess =
      1 + static_cast<double>(half) / static_cast<double>(seen + kOversampling - half - 1);
  const double middle = energy(half - quarter / 2, half + quarter / 2);
  const double early = energy(quarter - quarter / 2, quarter + quarter / 2);
  const double power = middle > 0 ? std::log2(std::max(1.0, early / middle)) : 0;
  const double per_rank = size_per_rank(block, cost);
  double missing = rows.missing[half] / excess, least = std::numeric_limits<double>::max();
  for (Index k = half + 1; k <= largest_rank_of(block); ++k) {
    missing -= middle * std::pow(static_cast<double>(half) / static_cast<double>(k), power);
    if (k <= seen) continue;
    least = std::min(least, cost.total(std::max(0.0, missing), per_rank * static_cast<double>(k)));
    if (missing <= 0) break;
  }
  return least;
}

void truncate_diagonal(const Shape& block, const RowSpectrum& rows, Index largest,
                       const CompressionCost& cost, LowRankBlock& result) {
  const Index m = block.rows, matrices = block.matrix_count;
  // Energy that is missing from the rows is missing from the columns too.
  const Index rank = cheapest_rank(rows, largest, cost, 2,
                                   [&](Index k) { return cost.size(m * k, k, matrices * k * k); });
  result.row_basis = rows.directions.leftCols(rank);
  double kept = 0;
  const MatrixXd projected = rows.project(rank);
  for (Index c = 0; c < matrices; ++c) {
    result.couplings.push_back(projected.middleCols(c * m, m) * result.row_basis);
    kept += result.couplings.back().squaredNorm();
  }
  result.error_squared = rows.missing[rank] + std::max(0.0, projected.squaredNorm() - kept);
}

void truncate(const Shape& block, const RowSpectrum& rows, Index largest,
              const CompressionCost& cost, LowRankBlock& result) {
  const Index m = block.rows, n = block.columns, matrices = block.matrix_count;
  // Half of the size of a coupling matrix counts for the rows, half for the columns.
  const Index row_rank = cheapest_rank(
      rows, largest, cost, 1, [&](Index k) { return cost.size(m * k, k, matrices * k * k / 2); });
  result.row_basis = rows.directions.leftCols(row_rank);
  result.error_squared = rows.missing[row_rank];
  const MatrixXd wide = rows.project(row_rank);
  MatrixXd projected(matrices * row_rank, n);
  for (Index c = 0; c < matrices; ++c) {
    projected.middleRows(c * row_rank, row_rank) = wide.middleCols(c * n, n);
  }
  Index column_rank = 0;
  if (row_rank > 0) {
    const Spectrum columns = right_spectrum(projected);
    column_rank = cheapest_rank(columns, largest, cost, 1, [&](Index k) {
      return cost.size(n * k, k, matrices * row_rank * k / 2);
    });
    result.column_basis = columns.directions.leftCols(column_rank);
    result.error_squared += columns.missing[column_rank];
  } else {
    result.column_basis.resize(n, 0);
  }
  for (Index c = 0; c < matrices; ++c) {
    result.couplings.push_back(projected.middleRows(c * row_rank, row_rank) * result.column_basis);
  }
}

template <typename Block>
BlockAttempt compress_any(const Block& block, const CompressionCost& cost, double limit,
                          Index largest_rank, std::uint64_t seed) {
  const Shape shape(block);
  const Index largest = std::min(largest_rank, largest_worthwhile_rank(shape, cost, limit));
  const RowSpectrum rows(block, largest, cost.multiplier * size_per_rank(shape, cost), seed);
  LowRankBlock result;
  result.on_diagonal = shape.on_diagonal;
  if (shape.on_diagonal) {
    truncate_diagonal(shape, rows, largest, cost, result);
  } else {
    truncate(shape, rows, largest, cost, result);
  }
  BlockAttempt attempt{{}, least_cost_beyond(shape, rows, largest, cost)};
  if (cost.of(result) < limit) attempt.block = std::move(result);
  return attempt;
}

}  // namespace

BlockAttempt compress_block(const WideBlock& block, const CompressionCost& cost, double limit,
                            Index largest_rank, std::uint64_t seed) {
  return compress_any(block, cost, limit, largest_rank, seed);
}

BlockAttempt compress_block(const StructuredBlock& block, const CompressionCost& cost, double limit,
                            Index largest_rank, std::uint64_t seed) {
  return compress_any(block, cost, limit, largest_rank, seed);
}

}  // namespace rebounce
