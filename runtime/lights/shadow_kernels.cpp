#include "runtime/lights/shadow_kernels.h"

namespace rebounce {

const ShadowKernels& shadow_kernels() {
#ifdef REBOUNCE_WITH_WIDE_KERNELS
  static const ShadowKernels& widest =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") ? kShadowKernelsAvx512
      : __builtin_cpu_supports("avx2")                                        ? kShadowKernelsAvx2
                                                                              : kShadowKernelsPortable;
  return widest;
#else
  return kShadowKernelsPortable;
#endif
}

}  // namespace rebounce
