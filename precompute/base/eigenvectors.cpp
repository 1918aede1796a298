#include "precompute/base/eigenvectors.h"

#include <Eigen/Eigenvalues>

// NOLINTNEXTLINE(readability-identifier-naming): the name is LAPACK's
extern "C" void dsyevd_(const void* job, const void* triangle, const void* rows, const void* matrix,
                        const void* stride, const void* values, const void* work,
                        const void* work_size, const void* integer_work,
                        const void* integer_work_size, const void* status);

namespace rebounce {
namespace {

// Below this number of rows, Eigen is as fast as LAPACK (lab/184). Above the other, LAPACK cannot
// count its work space in 32 bits.
constexpr Eigen::Index kLeastDivided = 112, kMostDivided = 32000;

/// False if LAPACK does not find them.
bool divide_and_conquer(const Eigen::MatrixXd& matrix, Eigenvectors& found) {
  const int rows = static_cast<int>(matrix.rows());
  found.vectors = matrix;
  found.values = Eigen::VectorXd::Zero(rows);
  const int work_size = 1 + 6 * rows + 2 * rows * rows, integer_work_size = 3 + 5 * rows;
  Eigen::VectorXd work = Eigen::VectorXd::Zero(work_size);
  Eigen::VectorXi integer_work = Eigen::VectorXi::Zero(integer_work_size);
  int status = 0;
  dsyevd_("V", "L", &rows, found.vectors.data(), &rows, found.values.data(), work.data(),
          &work_size, integer_work.data(), &integer_work_size, &status);
  return status == 0;
}

}  // namespace

Eigenvectors eigenvectors(const Eigen::MatrixXd& matrix) {
  if (matrix.rows() == 0) return {};
  Eigenvectors found;
  const bool divides = matrix.rows() >= kLeastDivided && matrix.rows() <= kMostDivided;
  if (divides && divide_and_conquer(matrix, found)) return found;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvectors(), solver.eigenvalues()};
}

}  // namespace rebounce
