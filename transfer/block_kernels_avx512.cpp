// Compiled with AVX-512F, BW, VL and VNNI; called only on processors that have it.

#include "block_kernels.h"
#include "block_kernels_impl.h"
#include "integers_avx512.h"
#include "vector_avx512.h"

namespace rebounce {

const BlockKernelSet kBlockKernelsAvx512 = make_block_kernels<Vector16, Shorts32>("avx512");

}  // namespace rebounce
