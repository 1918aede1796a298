#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// Copies values [n] into planes [3][stride], one channel after the other, zero beyond n.
inline void to_planes(std::span<const Float3> values, std::size_t stride, float* planes) {
  for (int c = 0; c < kChannelCount; ++c) {
    float* const plane = planes + c * stride;
    for (std::size_t i = 0; i < values.size(); ++i) plane[i] = values[i][c];
    std::fill(plane + values.size(), plane + stride, 0.0F);
  }
}

/// Copies planes [3][stride] back into values [n].
inline void from_planes(const float* planes, std::size_t stride, std::span<Float3> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) values[i][c] = planes[c * stride + i];
  }
}

}  // namespace rebounce
