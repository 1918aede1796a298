#include "gather_kernels.h"

#include "gather_kernels_impl.h"
#include "instruction_set.h"
#include "vector_portable.h"

namespace rebounce {

const GatherKernels kGatherKernelsPortable = make_gather_kernels<Vector4>("portable");

std::span<const GatherKernels* const> gather_kernel_sets() {
#if defined(__x86_64__)
  static const std::array kSets = {&kGatherKernelsPortable, &kGatherKernelsAvx2};
#else
  static const std::array kSets = {&kGatherKernelsPortable};
#endif
  return runnable(kSets);
}

const GatherKernels& gather_kernels() {
  static const GatherKernels& widest = *gather_kernel_sets().back();
  return widest;
}

}  // namespace rebounce
