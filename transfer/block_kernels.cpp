#include "block_kernels.h"

#include "block_kernels_impl.h"
#include "instruction_set.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const BlockKernelSet& pick_block_kernels() {
#if defined(__x86_64__)
  switch (widest_instruction_set()) {
    case InstructionSet::kAvx512:
      return kBlockKernelsAvx512;
    case InstructionSet::kAvx2:
      return kBlockKernelsAvx2;
    case InstructionSet::kPortable:
      break;
  }
#endif
  return kBlockKernelsPortable;
}

}  // namespace

const BlockKernelSet kBlockKernelsPortable = make_block_kernels<Vector4>("portable");

const BlockKernelSet& block_kernels() {
  static const BlockKernelSet& kernels = pick_block_kernels();
  return kernels;
}

}  // namespace rebounce
