#include "precompute/base/eigenvectors.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "precompute/base/orthonormal_columns.h"

namespace rebounce::test_eigenvectors {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class EigenvectorsOf : public testing::TestWithParam<int> {};

/// Values over twelve orders of magnitude, every third of them equal to the one before.
VectorXd steep_values(Eigen::Index rows) {
  VectorXd values(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const Eigen::Index step = k % 3 == 2 ? k - 1 : k;
    values[k] = std::pow(10, -12 + 12 * static_cast<double>(step) / static_cast<double>(rows));
  }
  return values;
}

TEST_P(EigenvectorsOf, AMatrixThatWasMadeOfThemAreFound) {
  std::srand(7);
  const int rows = GetParam();
  const VectorXd values = steep_values(rows);
  const MatrixXd vectors = orthonormal_columns<MatrixXd>(MatrixXd::Random(rows, rows));
  const MatrixXd matrix = vectors * values.asDiagonal() * vectors.transpose();
  MatrixXd lower = matrix.triangularView<Eigen::Lower>();
  lower.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);  // not read

  const Eigenvectors found = eigenvectors(lower);

  EXPECT_LT((found.values - values).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((matrix * found.vectors - found.vectors * found.values.asDiagonal()).norm(), 1e-13);
  EXPECT_LT((found.vectors.transpose() * found.vectors - MatrixXd::Identity(rows, rows)).norm(),
            1e-12);
}

INSTANTIATE_TEST_SUITE_P(Rows, EigenvectorsOf, testing::Values(1, 2, 60, 111, 112, 200, 512));

TEST(Eigenvectors, OfAMatrixOfZeroesAreOrthonormal) {
  const Eigenvectors found = eigenvectors(MatrixXd::Zero(130, 130));
  EXPECT_EQ(found.values, VectorXd::Zero(130));
  EXPECT_LT((found.vectors.transpose() * found.vectors - MatrixXd::Identity(130, 130)).norm(),
            1e-12);
}

TEST(Eigenvectors, OfNoRowsAreNone) {
  const Eigenvectors found = eigenvectors(MatrixXd(0, 0));
  EXPECT_EQ(found.vectors.size(), 0);
  EXPECT_EQ(found.values.size(), 0);
}

}  // namespace
}  // namespace rebounce::test_eigenvectors
