#include "runtime/lights/shadow_kernels.h"

#include <array>

namespace rebounce {
namespace {

#ifdef REBOUNCE_WITH_WIDE_KERNELS
std::size_t runnable_count() {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return 1;
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") ? 3 : 2;
}
#endif

}  // namespace

std::span<const ShadowKernels* const> shadow_kernel_sets() {
#ifdef REBOUNCE_WITH_WIDE_KERNELS
  static const std::array kSets = {&kShadowKernelsPortable, &kShadowKernelsAvx2,
                                   &kShadowKernelsAvx512};
  return std::span(kSets).first(runnable_count());
#else
  static const std::array kSets = {&kShadowKernelsPortable};
  return kSets;
#endif
}

const ShadowKernels& shadow_kernels() {
  static const ShadowKernels& widest = *shadow_kernel_sets().back();
  return widest;
}

}  // namespace rebounce
