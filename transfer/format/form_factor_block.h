#pragma once

#include <cstddef>

namespace rebounce {

/// Consecutive columns of F that FormFactorBlocks stores as one block.
inline constexpr std::size_t kFormFactorBlock = 8;

/// `count`, rounded up to a multiple of kFormFactorBlock.
constexpr std::size_t in_whole_blocks(std::size_t count) {
  return (count + kFormFactorBlock - 1) / kFormFactorBlock * kFormFactorBlock;
}

struct alignas(4 * kFormFactorBlock) FormFactorBlock {
  float value[kFormFactorBlock];
};

}  // namespace rebounce
