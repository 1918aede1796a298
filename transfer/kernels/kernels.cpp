#include "transfer/kernels/kernels.h"

#include <array>
#include <cstddef>

#ifdef REBOUNCE_WITH_WIDE_KERNELS
#include <cpuid.h>
#endif

namespace rebounce {
namespace {

#ifdef REBOUNCE_WITH_WIDE_KERNELS
// Reads CPUID itself: __builtin_cpu_supports of Clang before 18 does not know the name.
bool cpu_supports_f16c() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}

/// The number of sets, narrowest first, that this processor can run.
std::size_t runnable_count() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vnni")) {
    return 3;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && cpu_supports_f16c()) {
    return 2;
  }
  return 1;
}
#endif

}  // namespace

std::span<const KernelSet* const> kernel_sets() {
#ifdef REBOUNCE_WITH_WIDE_KERNELS
  static const std::array kSets = {&kKernelsPortable, &kKernelsAvx2, &kKernelsAvx512};
  return std::span(kSets).first(runnable_count());
#else
  static const std::array kSets = {&kKernelsPortable};
  return kSets;
#endif
}

const KernelSet& kernels() {
  static const KernelSet& widest = *kernel_sets().back();
  return widest;
}

}  // namespace rebounce
