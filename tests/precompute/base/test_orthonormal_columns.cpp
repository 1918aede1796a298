#include "precompute/base/orthonormal_columns.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "tests/support/with_threads.h"

namespace rebounce::test_orthonormal_columns {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

constexpr Index kRows = 9001, kColumns = 30;

/// Columns with singular values of 1 down to `least`.
MatrixXd steep_columns(double least) {
  std::srand(3);
  const MatrixXd left = orthonormal_columns<MatrixXd>(MatrixXd::Random(kRows, kColumns));
  const MatrixXd right = orthonormal_columns<MatrixXd>(MatrixXd::Random(kColumns, kColumns));
  VectorXd values(kColumns);
  for (Index k = 0; k < kColumns; ++k) values[k] = std::pow(least, k / (kColumns - 1.0));
  return left * values.asDiagonal() * right;
}

template <typename Matrix>
double beside_orthonormal(const Matrix& columns) {
  const MatrixXd products =
      columns.template cast<double>().transpose() * columns.template cast<double>();
  return (products - MatrixXd::Identity(products.rows(), products.cols())).norm();
}

/// What a basis misses of a matrix.
template <typename Matrix>
double missed(const Matrix& matrix, const Matrix& basis) {
  return (matrix - basis * (basis.transpose() * matrix)).norm() / matrix.norm();
}

class TallColumns : public testing::TestWithParam<double> {};

TEST_P(TallColumns, GetAnOrthonormalBasisOfAllThatTheySpan) {
  const MatrixXd matrix = steep_columns(GetParam());
  const MatrixXd basis = orthonormal_columns_of_tall(matrix);
  EXPECT_LT(beside_orthonormal(basis), 1e-13);
  EXPECT_LT(missed(matrix, basis), 1e-13);

  const MatrixXf single = matrix.cast<float>();
  const MatrixXf single_basis = orthonormal_columns_of_tall(single);
  EXPECT_LT(beside_orthonormal(single_basis), 2e-6);
  EXPECT_LT(missed(single, single_basis), 2e-6);
}

INSTANTIATE_TEST_SUITE_P(LeastValues, TallColumns, testing::Values(1, 1e-3, 1e-5, 1e-9, 1e-14));

TEST(TallColumns, OfWhichSomeAreZeroGetABasisOfTheOthers) {
  MatrixXd matrix = steep_columns(0.1);
  matrix.rightCols(3).setZero();
  const MatrixXd basis = orthonormal_columns_of_tall(matrix);
  EXPECT_EQ(basis.cols(), kColumns);
  EXPECT_LT(missed(matrix, basis), 1e-13);
}

TEST(TallColumns, GiveTheSameBitsForAnyNumberOfThreads) {
  const MatrixXf matrix = steep_columns(0.01).cast<float>();
  const auto basis = [&] { return orthonormal_columns_of_tall(matrix); };
  EXPECT_TRUE(test::with_threads(1, basis) == test::with_threads(3, basis));
}

}  // namespace
}  // namespace rebounce::test_orthonormal_columns
