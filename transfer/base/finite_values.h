#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

namespace rebounce {

/// True if no value is infinite or NaN. `Number`: float or double.
template <typename Number>
bool are_finite(std::span<const Number> values) {
  using Bits = std::conditional_t<sizeof(Number) == sizeof(float), std::uint32_t, std::uint64_t>;
  constexpr Bits kInfinity = std::bit_cast<Bits>(std::numeric_limits<Number>::infinity());
  constexpr Bits kMagnitude = ~Bits{0} >> 1U;  // all but the sign
  Bits largest = 0;
  for (const Number value : values) {
    largest = std::max(largest, std::bit_cast<Bits>(value) & kMagnitude);
  }
  return largest < kInfinity;
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
