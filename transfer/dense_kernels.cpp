#include "dense_kernels.h"

#include "dense_kernels_impl.h"
#include "instruction_set.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const DenseKernels& pick_dense_kernels() {
#if defined(__x86_64__)
  switch (widest_instruction_set()) {
    case InstructionSet::kAvx512:
      return kDenseKernelsAvx512;
    case InstructionSet::kAvx2:
      return kDenseKernelsAvx2;
    case InstructionSet::kPortable:
      break;
  }
#endif
  return kDenseKernelsPortable;
}

}  // namespace

const DenseKernels kDenseKernelsPortable = make_dense_kernels<Vector4>("portable");

const DenseKernels& dense_kernels() {
  static const DenseKernels& kernels = pick_dense_kernels();
  return kernels;
}

}  // namespace rebounce
