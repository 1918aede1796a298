#include "block_kernels.h"

#include <algorithm>

#include "block_kernels_impl.h"
#include "instruction_set.h"
#include "integers_portable.h"
#include "vector_portable.h"

namespace rebounce {
namespace {

const BlockKernelSet& pick_block_kernels() {
#if defined(__x86_64__)
  switch (widest_instruction_set()) {
    case InstructionSet::kAvx512:
      return kBlockKernelsAvx512;
    case InstructionSet::kAvx2:
      return kBlockKernelsAvx2;
    case InstructionSet::kPortable:
      break;
  }
#endif
  return kBlockKernelsPortable;
}

}  // namespace

ChannelLanes::ChannelLanes(const std::array<std::uint32_t, kChannelCount>& channel_matrix,
                           std::uint32_t matrices)
    : value{}, matrix_count(matrices) {
  for (std::size_t lane = 0; lane < value.size(); ++lane) {
    const std::size_t channel = std::min<std::size_t>(lane % kChannelLanes, kChannelCount - 1);
    value[lane] =
        static_cast<std::uint16_t>(lane / kChannelLanes * matrix_count + channel_matrix[channel]);
  }
}

const BlockKernelSet kBlockKernelsPortable = make_block_kernels<Vector4, Shorts8>("portable");

const BlockKernelSet& block_kernels() {
  static const BlockKernelSet& kernels = pick_block_kernels();
  return kernels;
}

}  // namespace rebounce
