#include "block_kernels.h"

#include <algorithm>

#include "block_kernels_impl.h"
#include "instruction_set.h"
#include "integers_portable.h"
#include "vector_portable.h"

namespace rebounce {

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

std::span<const BlockKernelSet* const> block_kernel_sets() {
#if defined(__x86_64__)
  static const std::array kSets = {&kBlockKernelsPortable, &kBlockKernelsAvx2,
                                   &kBlockKernelsAvx512};
#else
  static const std::array kSets = {&kBlockKernelsPortable};
#endif
  return runnable(kSets);
}

const BlockKernelSet& block_kernels() {
  static const BlockKernelSet& widest = *block_kernel_sets().back();
  return widest;
}

}  // namespace rebounce
