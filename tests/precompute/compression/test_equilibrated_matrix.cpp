// Matrices whose rows and columns are divided by scales, and operators made of them.

#include "precompute/compression/equilibrated_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "precompute/compression/tolerance_search.h"
#include "precompute/lights/reference_lighting.h"
#include "tests/support/solved_room.h"
#include "tests/support/unshadowed_lights.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::test_equilibrated_matrix {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

const test::SolvedRoom& room() {
  static const test::SolvedRoom made(
      test::furnished_room({0.7F, 0.5F, 0.2F}, {0.3F, 0.3F, 0.3F}, {0.1F, 0.3F, 0.9F}), 800);
  return made;
}

/// Of one patch in five `dark`, of the others 0.
std::vector<std::int8_t> exponents(std::int8_t dark) {
  std::mt19937_64 engine(1);
  std::vector<std::int8_t> result(room().patches.size(), 0);
  for (std::int8_t& exponent : result) exponent = engine() % 5 == 0 ? dark : std::int8_t{0};
  return result;
}

TEST(EquilibratedMatrix, IsTheMatrixOverTheScalesOfBothPatches) {
  const DenseMatrix matrix(*room().dense);
  const std::vector<std::int8_t> exponent = exponents(7);
  const EquilibratedMatrix equilibrated(matrix, exponent);
  std::vector<std::uint32_t> all(room().patches.size());
  std::iota(all.begin(), all.end(), 0U);
  const auto n = static_cast<Index>(all.size());
  MatrixXf before(n, n), after(n, n);
  for (std::uint32_t m = 0; m < matrix.matrix_count(); ++m) {
    matrix.entries(m, all, all, before);
    equilibrated.entries(m, all, all, after);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const int scale =
            exponent[static_cast<std::size_t>(i)] + exponent[static_cast<std::size_t>(j)];
        ASSERT_EQ(after(i, j), std::ldexp(before(i, j), -scale));
      }
    }
    const MatrixXf x = MatrixXf::Random(n, 3);
    EXPECT_LT((equilibrated.multiply(m, x) - after * x).norm(), 1e-5 * (after * x).norm());
  }
}

/// Errors in what the light of each patch does alone.
std::vector<double> single_patch_errors(const SymmetricMatrix& matrix,
                                        const TransferOperator& transfer) {
  std::vector<std::vector<Float3>> lights;
  for (std::size_t p = 0; p < transfer.patch_count(); ++p) {
    lights.emplace_back(transfer.patch_count())[p] = {1, 1, 1};
  }
  return ReferenceLighting(matrix, lights).errors(transfer);
}

double mean_where(const std::vector<double>& errors, const std::vector<std::int8_t>& exponent,
                  bool dark) {
  double sum = 0, count = 0;
  for (std::size_t p = 0; p < errors.size(); ++p) {
    if ((exponent[p] != 0) != dark) continue;
    sum += errors[p];
    ++count;
  }
  return sum / count;
}

TEST(EquilibratedMatrix, PatchesOfWhoseLightLittleArrivesAreRoundedAsWellAsOthers) {
  // One patch in five exchanges a 64th with others, like those at the bottom of slots.
  const std::vector<std::int8_t> exponent = exponents(6);
  const DenseMatrix matrix(*room().dense);
  const EquilibratedMatrix slots(matrix, exponent);
  const auto training = test::unshadowed_lights(room().patches, 24, 1, 2.2, 0.7),
             validation = test::unshadowed_lights(room().patches, 40, 2, 2.2, 0.7);
  const auto transfer =
      compress_to_tolerance(slots, room().patches, {training, validation}, {.tolerance = 0.01});
  const std::vector<double> errors = single_patch_errors(slots, *transfer);
  ASSERT_EQ(errors.size(), exponent.size());
  EXPECT_LT(mean_where(errors, exponent, true), 1.5 * mean_where(errors, exponent, false));
  EXPECT_LT(std::ranges::max(errors), 0.2);
}

}  // namespace
}  // namespace rebounce::test_equilibrated_matrix
