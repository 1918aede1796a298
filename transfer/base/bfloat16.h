#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace rebounce {

/// Converts bfloat16 bits, the upper half of a float (sign, exponent, 7 bits of mantissa). Exact.
inline float bfloat16_to_float(std::uint16_t bits) {
  return std::bit_cast<float>(std::uint32_t{bits} << 16);
}

/// The nearest bfloat16 number to a finite value (ties to even), within a relative 2^-8. Infinity
/// near the largest float.
inline std::uint16_t float_to_bfloat16(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return static_cast<std::uint16_t>((bits + 0x7FFFU + ((bits >> 16) & 1U)) >> 16);
}

/// The bits of three numbers, such as a gradient.
using BFloat16x3 = std::array<std::uint16_t, 3>;

inline BFloat16x3 to_bfloat16(float x, float y, float z) {
  return {float_to_bfloat16(x), float_to_bfloat16(y), float_to_bfloat16(z)};
}

inline std::array<float, 3> to_floats(const BFloat16x3& bits) {
  return {bfloat16_to_float(bits[0]), bfloat16_to_float(bits[1]), bfloat16_to_float(bits[2])};
}

}  // namespace rebounce
