#include "link_kernels.h"

#include "instruction_set.h"
#include "link_gather.h"

namespace rebounce {
namespace {

const LinkKernels& pick_link_kernels() {
#if defined(__x86_64__)
  switch (widest_instruction_set()) {
    case InstructionSet::kAvx512:
      return kLinkKernelsAvx512;
    case InstructionSet::kAvx2:
      return kLinkKernelsAvx2;
    case InstructionSet::kPortable:
      break;
  }
#endif
  return kLinkKernelsPortable;
}

}  // namespace

const LinkKernels kLinkKernelsPortable = {"portable", gather_along_links<ColorLanes>};

const LinkKernels& link_kernels() {
  static const LinkKernels& kernels = pick_link_kernels();
  return kernels;
}

}  // namespace rebounce
