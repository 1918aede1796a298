#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "precompute/base/progress.h"

namespace rebounce {

/// A symmetric matrix of doubles or floats, stored as the lower triangle of square tiles. Tiles on
/// the diagonal store both halves. The last tiles are padded with the identity.
template <typename Scalar>
class TiledMatrix {
 public:
  static constexpr Eigen::Index kTile = 256;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Tile = Eigen::Map<Matrix>;

  explicit TiledMatrix(std::size_t size);

  static std::size_t bytes(std::size_t size);

  std::size_t size() const { return size_; }
  std::size_t side() const { return side_; }  ///< tiles per row

  /// Tile (row, column), row >= column.
  Tile tile(std::size_t row, std::size_t column) {
    Scalar* begin = values_.data() + (row * (row + 1) / 2 + column) * kTile * kTile;
    return {begin, kTile, kTile};
  }

  /// Entry (row, column) of the lower triangle.
  Scalar& at(std::size_t row, std::size_t column) {
    return tile(row / kTile, column / kTile)(row % kTile, column % kTile);
  }

 private:
  std::size_t size_, side_;
  std::vector<Scalar> values_;
};

/// Replaces a symmetric positive definite matrix by its inverse (lower triangle), through its
/// Cholesky factor L: M = L L^T, then L^-1, then L^-T L^-1. Takes n³ multiply-adds.
///
/// The algorithms are the tiled ones of A. Buttari, J. Langou, J. Kurzak and J. Dongarra, "A class
/// of parallel tiled linear algebra algorithms for multicore architectures", 2009. Every tile gets
/// its updates in a fixed order and BLAS runs on one thread, so the bits do not depend on the
/// number of OpenMP threads. Denormal numbers count as zero: where patches exchange very little
/// light, products of small numbers are denormal and slow on some processors. Throws Error if the
/// matrix is not positive definite, Cancelled if asked to stop.
template <typename Scalar>
void invert_positive_definite(TiledMatrix<Scalar>& matrix, const Progress& progress = {});

extern template class TiledMatrix<double>;
extern template class TiledMatrix<float>;

}  // namespace rebounce
