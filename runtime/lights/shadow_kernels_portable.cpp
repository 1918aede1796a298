#include "runtime/lights/shadow_kernels_impl.h"

namespace rebounce {

constinit const ShadowKernels kShadowKernelsPortable = make_shadow_kernels("portable");

}  // namespace rebounce
