// Tests that use a BLAS: with its kernels for this processor, as the program has them.

#include <gtest/gtest.h>

#include "rebounce/precompute/blas_kernels.h"

int main(int argc, char** argv) {
  rebounce::restart_with_better_blas_kernels(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
