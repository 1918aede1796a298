#pragma once

#include <Eigen/Core>

namespace rebounce {

/// The eigenvectors of a symmetric matrix, and their eigenvalues in ascending order.
struct Eigenvectors {
  Eigen::MatrixXd vectors;  ///< [rows][rows], orthonormal, one to a column
  Eigen::VectorXd values;   ///< [rows]
};

/// Reads the lower triangle of `matrix`, [rows][rows] of finite values. Large matrices go to
/// LAPACK, which divides and conquers (dsyevd; Cuppen 1981), small ones to the QR iteration of
/// Eigen.
Eigenvectors eigenvectors(const Eigen::MatrixXd& matrix);

}  // namespace rebounce
