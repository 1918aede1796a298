#include "precompute/base/orthonormal_columns.h"

#include <Eigen/Cholesky>
#include <optional>
#include <vector>

#include "precompute/base/blas.h"
#include "precompute/base/parallel_loop.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The rows that a thread takes at a time.
constexpr Index kGroupRows = 4096;

// The Gram matrix has the condition of the columns squared. They are as good as dependent if a
// pivot is below this part of the largest.
constexpr double kLeastPivot = 1e-6;

/// Calls work(group, first row, rows) for groups of rows on OpenMP's threads.
template <typename Matrix, typename Work>
void for_groups(const Matrix& matrix, const Work& work) {
  const auto count = static_cast<std::size_t>((matrix.rows() + kGroupRows - 1) / kGroupRows);
  parallel_loop(count, [&](std::size_t group) {
    const Index begin = static_cast<Index>(group) * kGroupRows;
    work(group, begin, std::min(kGroupRows, matrix.rows() - begin));
  });
}

/// Its sums are the same for any number of threads.
template <typename Matrix>
MatrixXd gram_of(const Matrix& matrix) {
  std::vector<MatrixXd> parts(
      static_cast<std::size_t>((matrix.rows() + kGroupRows - 1) / kGroupRows));
  for_groups(matrix, [&](std::size_t group, Index begin, Index count) {
    const MatrixXd rows = matrix.middleRows(begin, count).template cast<double>();
    parts[group] = MatrixXd::Zero(matrix.cols(), matrix.cols());
    parts[group].template selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  });
  MatrixXd gram = MatrixXd::Zero(matrix.cols(), matrix.cols());
  for (const MatrixXd& part : parts) gram += part;
  return gram;
}

/// None where columns nearly depend on each other.
template <typename Matrix>
std::optional<Matrix> cholesky_columns(const Matrix& matrix) {
  const Eigen::LLT<MatrixXd> factor(gram_of(matrix));
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::VectorXd pivots = factor.matrixLLT().diagonal();
  if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return std::nullopt;
  Matrix columns(matrix.rows(), matrix.cols());
  for_groups(matrix, [&](std::size_t, Index begin, Index count) {
    MatrixXd rows = matrix.middleRows(begin, count).template cast<double>();
    factor.matrixU().template solveInPlace<Eigen::OnTheRight>(rows);
    columns.middleRows(begin, count) = rows.template cast<typename Matrix::Scalar>();
  });
  return columns;
}

template <typename Matrix>
Matrix tall(const Matrix& matrix) {
  if (matrix.cols() == 0) return matrix;
  load_blas();
  if (matrix.rows() >= matrix.cols()) {
    if (const std::optional<Matrix> once = cholesky_columns(matrix)) {
      if (std::optional<Matrix> twice = cholesky_columns(*once)) return *std::move(twice);
    }
  }
  return orthonormal_columns(matrix);
}

}  // namespace

Eigen::MatrixXf orthonormal_columns_of_tall(const Eigen::MatrixXf& matrix) {
  return tall(matrix);
}

Eigen::MatrixXd orthonormal_columns_of_tall(const Eigen::MatrixXd& matrix) {
  return tall(matrix);
}

}  // namespace rebounce
