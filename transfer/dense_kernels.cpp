#include "dense_kernels.h"

#include "dense_kernels_impl.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const DenseKernels& pick_dense_kernels() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return kDenseKernelsAvx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("f16c")) {
    return kDenseKernelsAvx2;
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
