// Compiled with AVX2, FMA and F16C; called only on processors that have them. Per block a gather
// loads 32 bytes of F and 96 of the vector: at two loads a cycle that is 16 bytes of F a cycle,
// several times what memory delivers, so that wider registers would gain nothing.

#include "gather_kernels.h"
#include "gather_kernels_impl.h"
#include "vector_avx2.h"

namespace rebounce {

const GatherKernels kGatherKernelsAvx2 = make_gather_kernels<Vector8>("avx2");

}  // namespace rebounce
