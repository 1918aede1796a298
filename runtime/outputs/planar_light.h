#pragma once

#include <array>
#include <cstddef>

#include "rebounce/scene_data.h"

namespace rebounce {

/// Coefficients of degree 0 to 2, stored channel by channel, so that the compiler vectorises loops
/// over them.
struct PlanarLight {
  std::array<Harmonics, kChannelCount> channel{};

  /// Adds `weight` times `color`.
  void add(const Harmonics& weight, const Float3& color) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      for (std::size_t k = 0; k < kHarmonicCount; ++k) channel[c][k] += color[c] * weight[k];
    }
  }
  std::array<Float3, kHarmonicCount> interleaved() const {
    std::array<Float3, kHarmonicCount> light;
    for (std::size_t k = 0; k < kHarmonicCount; ++k) {
      light[k] = {channel[0][k], channel[1][k], channel[2][k]};
    }
    return light;
  }
};

}  // namespace rebounce
