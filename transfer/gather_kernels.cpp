#include "gather_kernels.h"

#include "gather_kernels_impl.h"
#include "instruction_set.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const GatherKernels& pick_gather_kernels() {
#if defined(__x86_64__)
  if (widest_instruction_set() >= InstructionSet::kAvx2) return kGatherKernelsAvx2;
#endif
  return kGatherKernelsPortable;
}

}  // namespace

const GatherKernels kGatherKernelsPortable = make_gather_kernels<Vector4>("portable");

const GatherKernels& gather_kernels() {
  static const GatherKernels& kernels = pick_gather_kernels();
  return kernels;
}

}  // namespace rebounce
