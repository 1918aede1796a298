#include "instruction_sets.h"

namespace rebounce::bench {

std::vector<const DenseKernels*> available_kernels() {
  std::vector<const DenseKernels*> sets = {&kDenseKernelsPortable};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("f16c")) {
    sets.push_back(&kDenseKernelsAvx2);
  }
  if (__builtin_cpu_supports("avx512f")) sets.push_back(&kDenseKernelsAvx512);
#endif
  return sets;
}

}  // namespace rebounce::bench
