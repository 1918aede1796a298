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

}  // namespace rebounce
