#include "rebounce/precompute/blas_kernels.h"

#include <cblas.h>
#include <gtest/gtest.h>

namespace rebounce {
namespace {

TEST(BlasKernels, AreReplacedWhereTheProcessorIsUnknown) {
  EXPECT_EQ(better_blas_kernels("Prescott", {.avx2_and_fma = true, .avx512 = true}), "SkylakeX");
  EXPECT_EQ(better_blas_kernels("Prescott", {.avx2_and_fma = true}), "Haswell");
}

TEST(BlasKernels, AreKeptWhereTheyWillDo) {
  EXPECT_EQ(better_blas_kernels("Prescott", {}), "");
  for (const char* known : {"Haswell", "Zen", "SkylakeX", "Cooperlake"}) {
    EXPECT_EQ(better_blas_kernels(known, {.avx2_and_fma = true, .avx512 = true}), "") << known;
  }
}

TEST(BlasKernels, OfThisProgramAreThoseOfTheProcessor) {
  EXPECT_EQ(better_blas_kernels(openblas_get_corename(), processor_features()), "")
      << openblas_get_corename();
}

}  // namespace
}  // namespace rebounce
