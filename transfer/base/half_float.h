#pragma once

#include <bit>
#include <cstdint>

namespace rebounce {

/// Converts IEEE 754 half-precision bits to a float. Exact.
inline float half_to_float(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000U) << 16;
  const std::uint32_t magnitude = half & 0x7FFFU;
  if (magnitude >= 0x7C00U) return std::bit_cast<float>(sign | 0x7F800000U | (magnitude << 13));
  // After the shift the exponent is 127 - 15 too small. A product with 2^112 corrects it and makes
  // subnormal halves normal.
  const float scaled = std::bit_cast<float>(magnitude << 13) * 0x1p112F;
  return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(scaled));
}

/// The bits of the nearest half-precision number (ties to even); infinity beyond 65,504.
inline std::uint16_t float_to_half(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000U);
  const std::uint32_t magnitude = bits & 0x7FFFFFFFU;
  if (magnitude >= 0x7F800000U) {
    return sign | (magnitude > 0x7F800000U ? 0x7E00U : 0x7C00U);
  }
  if (magnitude < 0x38800000U) {  // subnormal half: the addition of floats rounds at 2^-24
    const float rounded = std::bit_cast<float>(magnitude) + 0.5F;
    return sign | static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(rounded) - 0x3F000000U);
  }
  const std::uint32_t rounded = magnitude + 0xFFFU + ((magnitude >> 13) & 1U) - 0x38000000U;
  return rounded >= 0x0F800000U ? static_cast<std::uint16_t>(sign | 0x7C00U)
                                : static_cast<std::uint16_t>(sign | (rounded >> 13));
}

}  // namespace rebounce
