// Compiled with AVX2, FMA and F16C; only called on processors that have them.

#include "transfer/kernels/integers_avx2.h"
#include "transfer/kernels/kernels_impl.h"
#include "transfer/kernels/link_gather_avx2.h"
#include "transfer/kernels/vector_avx2.h"

namespace rebounce {

constinit const GatherKernels kGatherKernelsAvx2 = make_gather_kernels<Vector8>();

constinit const KernelSet kKernelsAvx2 =
    make_kernels<Vector8, Integers256>("avx2", kGatherKernelsAvx2, gather_avx2);

}  // namespace rebounce
