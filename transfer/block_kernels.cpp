#include "block_kernels.h"

#include "block_kernels_impl.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const BlockKernelSet& pick_block_kernels() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return kBlockKernelsAvx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("f16c")) {
    return kBlockKernelsAvx2;
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
