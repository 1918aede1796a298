#include "precompute/inverse/tiled_cholesky.h"

#include <gtest/gtest.h>

#include "rebounce/error.h"

namespace rebounce::test_tiled_cholesky {
namespace {

/// Ones, and -`coupling` beside them: of the inverse, coupling^|i - j| and next to nothing more.
TiledMatrix<float> chain(std::size_t size, float coupling) {
  TiledMatrix<float> matrix(size);
  for (std::size_t i = 0; i < size; ++i) {
    matrix.at(i, i) = 1;
    if (i == 0) continue;
    matrix.at(i, i - 1) = -coupling;
    if (i % TiledMatrix<float>::kTile != 0) matrix.at(i - 1, i) = -coupling;
  }
  return matrix;
}

/// How many threads have a product that is denormal, and do not take it for zero.
int threads_with_denormals() {
  int count = 0;
#pragma omp parallel reduction(+ : count)
  {
    volatile float little = 1e-30F, less = 1e-10F;
    if (little * less > 0) ++count;
  }
  return count;
}

int thread_count() {
  int count = 0;
#pragma omp parallel reduction(+ : count)
  ++count;
  return count;
}

TEST(TiledCholesky, OfAChainThePowersOfItsCoupling) {
  constexpr std::size_t kSize = 600;  // three tiles, of which the last is not full
  TiledMatrix<float> matrix = chain(kSize, 1e-3F);
  invert_positive_definite(matrix);
  for (const std::size_t i : {2UL, 255UL, 256UL, 258UL, 511UL, 513UL, 599UL}) {
    EXPECT_NEAR(matrix.at(i, i), 1, 1e-5);
    EXPECT_NEAR(matrix.at(i, i - 1), 1e-3, 1e-8);
    EXPECT_NEAR(matrix.at(i, i - 2), 1e-6, 1e-11);
  }
}

#if defined(__x86_64__)
TEST(TiledCholesky, DenormalNumbersCountAsZero) {
  constexpr std::size_t kSize = 600;
  TiledMatrix<float> matrix = chain(kSize, 1e-20F);
  invert_positive_definite(matrix);
  for (std::size_t i = 2; i < kSize; ++i) {
    ASSERT_FLOAT_EQ(matrix.at(i, i - 1), 1e-20F) << i;
    ASSERT_EQ(matrix.at(i, i - 2), 0) << i;  // 1e-40
  }
}
#endif

TEST(TiledCholesky, ThreadsHaveDenormalNumbersAfterwards) {
  TiledMatrix<float> matrix = chain(600, 1e-20F);
  invert_positive_definite(matrix);
  EXPECT_EQ(threads_with_denormals(), thread_count());
  TiledMatrix<float> stopped = chain(600, 1e-20F);
  EXPECT_THROW(invert_positive_definite(stopped, [](double) { return false; }), Cancelled);
  EXPECT_EQ(threads_with_denormals(), thread_count());
}

TEST(TiledCholesky, NotPositiveDefinite) {
  TiledMatrix<float> matrix = chain(600, 1);
  EXPECT_THROW(invert_positive_definite(matrix), Error);
}

}  // namespace
}  // namespace rebounce::test_tiled_cholesky
