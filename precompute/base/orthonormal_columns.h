#pragma once

#include <Eigen/QR>
#include <algorithm>

namespace rebounce {

/// An orthonormal basis of the columns of a matrix, [rows][min(rows, columns)], by Householder QR.
template <typename Matrix>
Matrix orthonormal_columns(const Matrix& matrix) {
  return Eigen::HouseholderQR<Matrix>(matrix).householderQ() *
         Matrix::Identity(matrix.rows(), std::min(matrix.rows(), matrix.cols()));
}

/// The same for a matrix with far more rows than columns. OpenMP's threads share the rows: Cholesky
/// QR, twice (Yamamoto et al. 2015), or Householder QR where columns nearly depend on each other.
Eigen::MatrixXf orthonormal_columns_of_tall(const Eigen::MatrixXf& matrix);
Eigen::MatrixXd orthonormal_columns_of_tall(const Eigen::MatrixXd& matrix);

}  // namespace rebounce
