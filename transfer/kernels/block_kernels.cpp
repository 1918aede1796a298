#include "transfer/kernels/block_kernels.h"

#include <algorithm>

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

}  // namespace rebounce
