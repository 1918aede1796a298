#pragma once

#include <cstddef>
#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// sum += weight x values, entry by entry; both have as many.
inline void add_to(std::span<Float3> sum, std::span<const Float3> values, float weight = 1) {
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) sum[i][c] += weight * values[i][c];
  }
}

}  // namespace rebounce
