#include "link_kernels.h"

#include "bfloat16.h"
#include "instruction_set.h"

namespace rebounce {
namespace {

void add(ColorLanes& to, float factor, const ColorLanes& from) {
  for (std::size_t c = 0; c < kColorLanes; ++c) to[c] += factor * from[c];
}

LinkLight gather_portable(const IncomingLink* link, std::size_t count, const LinkLight* light) {
  LinkLight sum{};
  for (std::size_t l = 0; l < count; ++l) {
    const LinkLight& from = light[link[l].from];
    add(sum.mean, link[l].exchange_area, from.mean);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      add(sum.mean, bfloat16_to_float(link[l].gradient_from[axis]), from.first[axis]);
      add(sum.first[axis], bfloat16_to_float(link[l].gradient_to[axis]), from.mean);
    }
  }
  return sum;
}

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

const LinkKernels kLinkKernelsPortable = {"portable", gather_portable};

const LinkKernels& link_kernels() {
  static const LinkKernels& kernels = pick_link_kernels();
  return kernels;
}

}  // namespace rebounce
