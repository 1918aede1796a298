#include "dense_kernels.h"

#include "dense_kernels_impl.h"
#include "instruction_set.h"
#include "vector_portable.h"

namespace rebounce {

const DenseKernels kDenseKernelsPortable = make_dense_kernels<Vector4>("portable");

std::span<const DenseKernels* const> dense_kernel_sets() {
#if defined(__x86_64__)
  static const std::array kSets = {&kDenseKernelsPortable, &kDenseKernelsAvx2,
                                   &kDenseKernelsAvx512};
#else
  static const std::array kSets = {&kDenseKernelsPortable};
#endif
  return runnable(kSets);
}

const DenseKernels& dense_kernels() {
  static const DenseKernels& widest = *dense_kernel_sets().back();
  return widest;
}

}  // namespace rebounce
