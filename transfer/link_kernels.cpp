#include "link_kernels.h"

#include "instruction_set.h"
#include "link_gather.h"

namespace rebounce {

const LinkKernels kLinkKernelsPortable = {"portable", gather_along_links<ColorLanes>,
                                          gather_along_links<ManyFloats>,
                                          gather_along_links<ManyDoubles>};

std::span<const LinkKernels* const> link_kernel_sets() {
#if defined(__x86_64__)
  static const std::array kSets = {&kLinkKernelsPortable, &kLinkKernelsAvx2, &kLinkKernelsAvx512};
#else
  static const std::array kSets = {&kLinkKernelsPortable};
#endif
  return runnable(kSets);
}

const LinkKernels& link_kernels() {
  static const LinkKernels& widest = *link_kernel_sets().back();
  return widest;
}

}  // namespace rebounce
