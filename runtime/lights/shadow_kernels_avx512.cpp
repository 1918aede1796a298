// Compiled for Avx512; only called on processors that have it.

#include "runtime/lights/shadow_kernels_impl.h"

namespace rebounce {

constinit const ShadowKernels kShadowKernelsAvx512 = make_shadow_kernels("avx512");

}  // namespace rebounce
