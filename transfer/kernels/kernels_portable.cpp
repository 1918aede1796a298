#include "transfer/kernels/integers_portable.h"
#include "transfer/kernels/kernels_impl.h"
#include "transfer/kernels/vector_portable.h"

namespace rebounce {
namespace {

constexpr GatherKernels kGatherKernels = make_gather_kernels<Vector4>();

}  // namespace

constinit const KernelSet kKernelsPortable =
    make_kernels<Vector4, Integers128>("portable", kGatherKernels, gather_along_links<ColorLanes>);

}  // namespace rebounce
