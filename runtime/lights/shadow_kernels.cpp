#include "runtime/lights/shadow_kernels.h"

namespace rebounce {

const ShadowKernels& shadow_kernels() {
#ifdef REBOUNCE_WITH_WIDE_KERNELS
  static const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  static const bool has_avx512 =
      has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
  return has_avx512 ? kShadowKernelsAvx512 : has_avx2 ? kShadowKernelsAvx2 : kShadowKernelsPortable;
#else
  return kShadowKernelsPortable;
#endif
}

}  // namespace rebounce
