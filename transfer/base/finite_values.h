#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>

namespace rebounce {

/// True if no value is infinite or NaN.
inline bool are_finite(std::span<const float> values) {
  std::uint32_t largest = 0;
  for (const float value : values) {
    largest = std::max(largest, std::bit_cast<std::uint32_t>(value) & 0x7FFFFFFFU);
  }
  return largest < 0x7F800000U;
}

/// True if none of the IEEE half-precision numbers with these bits is infinite or NaN.
inline bool halves_are_finite(std::span<const std::uint16_t> halves) {
  std::uint16_t largest = 0;
  for (const std::uint16_t half : halves) {
    largest = std::max(largest, static_cast<std::uint16_t>(half & 0x7FFFU));
  }
  return largest < 0x7C00U;
}

}  // namespace rebounce
