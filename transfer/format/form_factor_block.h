#pragma once

#include <cstddef>

namespace rebounce {

/// Consecutive columns that FormFactorBlocks keeps together.
inline constexpr std::size_t kFormFactorBlock = 8;

/// `count`, rounded up to whole blocks.
constexpr std::size_t in_whole_blocks(std::size_t count) {
  return (count + kFormFactorBlock - 1) / kFormFactorBlock * kFormFactorBlock;
}

struct alignas(4 * kFormFactorBlock) FormFactorBlock {
  float value[kFormFactorBlock];
};

}  // namespace rebounce
