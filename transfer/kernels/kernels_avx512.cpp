// Compiled with AVX-512 F, BW, VL and VNNI; only called on processors that have them.

#include "transfer/kernels/integers_avx512.h"
#include "transfer/kernels/kernels_impl.h"
#include "transfer/kernels/link_gather_avx512.h"
#include "transfer/kernels/vector_avx512.h"

namespace rebounce {

constinit const KernelSet kKernelsAvx512 =
    make_kernels<Vector16, Integers512>("avx512", kGatherKernelsAvx2, gather_avx512);

}  // namespace rebounce
