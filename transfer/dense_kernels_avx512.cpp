// Compiled with AVX-512F; called only on processors that have it.

#include "dense_kernels.h"
#include "dense_kernels_impl.h"
#include "vector_avx512.h"

namespace rebounce {

const DenseKernels kDenseKernelsAvx512 = make_dense_kernels<Vector16>("avx512");

}  // namespace rebounce
