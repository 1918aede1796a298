// Compiled with AVX2, FMA and F16C; called only on processors that have them.

#include "block_kernels.h"
#include "block_kernels_impl.h"
#include "integers_avx2.h"
#include "vector_avx2.h"

namespace rebounce {

const BlockKernelSet kBlockKernelsAvx2 = make_block_kernels<Vector8, Shorts16>("avx2");

}  // namespace rebounce
