#include "transfer/kernels/kernels_impl.h"
#include "transfer/kernels/vector_portable.h"

#if defined(__wasm_simd128__)
#include "transfer/kernels/integers_wasm.h"
#else
#include "transfer/kernels/integers_portable.h"
#endif

namespace rebounce {
namespace {

#if defined(__wasm_simd128__)
using Integers = IntegersWasm;
#else
using Integers = Integers128;
#endif

constexpr GatherKernels kGatherKernels = make_gather_kernels<Vector4>();

}  // namespace

constinit const KernelSet kKernelsPortable =
    make_kernels<Vector4, Integers>("portable", kGatherKernels, gather_along_links<ColorLanes>);

}  // namespace rebounce
