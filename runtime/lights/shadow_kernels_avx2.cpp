// Compiled for Avx2; only called on processors that have it.

#include "runtime/lights/shadow_kernels_impl.h"

namespace rebounce {

constinit const ShadowKernels kShadowKernelsAvx2 = make_shadow_kernels("avx2");

}  // namespace rebounce
