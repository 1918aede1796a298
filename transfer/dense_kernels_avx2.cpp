// Compiled with AVX2, FMA and F16C; called only on processors that have them.

#include "dense_kernels.h"
#include "dense_kernels_impl.h"
#include "vector_avx2.h"

namespace rebounce {

const DenseKernels kDenseKernelsAvx2 = make_dense_kernels<Vector8>("avx2");

}  // namespace rebounce
