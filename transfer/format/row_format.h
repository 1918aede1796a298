#pragma once

#include <bit>
#include <cstdint>

namespace rebounce {

/// Instead of the index of a RowFormat: the values of a block are not packed.
inline constexpr std::uint32_t kNotPacked = 0xFFFFFFFF;

/// How a row of a coupling matrix is stored in an operator with integer bases: as signed integers
/// of 4, 8, 12 or 16 bits, times a step that is a power of two.
///
/// One byte describes it: bits / 4 - 1 in its two lowest bits, and above them the binary exponent
/// of the step plus 48. Every byte is valid. Entry k begins at bit k x bits of the row, the lowest
/// bit of a byte first. A row begins with a byte.
struct RowFormat {
  static constexpr int kLeastExponent = -48, kMostExponent = 15;

  std::uint8_t stored = 0;

  /// `bits`: 4, 8, 12 or 16; `exponent`: from kLeastExponent to kMostExponent.
  static constexpr RowFormat of(int bits, int exponent) {
    return {static_cast<std::uint8_t>((bits / 4 - 1) + 4 * (exponent - kLeastExponent))};
  }

  constexpr unsigned width() const { return stored & 3U; }       ///< bits / 4 - 1
  constexpr unsigned half_bytes() const { return width() + 1; }  ///< of an entry
  constexpr unsigned bits() const { return half_bytes() * 4; }
  constexpr float step() const {
    constexpr unsigned kBias = 127 + kLeastExponent;
    return std::bit_cast<float>(((stored >> 2U) + kBias) << 23U);
  }
  /// The bytes of a row of `count` entries.
  std::uint64_t row_bytes(std::uint64_t count) const { return bytes_of(width(), count); }
  static std::uint64_t bytes_of(unsigned width, std::uint64_t count) {
    return (count * (width + 1) + 1) / 2;
  }
};

/// The integer at half byte `at` of a packed row.
inline std::int32_t unpacked(const std::uint8_t* row, std::uint64_t at, RowFormat format) {
  const std::uint8_t* const bytes = row + at / 2;
  const unsigned above = 32 - format.bits();
  std::uint32_t value = bytes[0];
  if (format.half_bytes() > 2) value |= std::uint32_t{bytes[1]} << 8U;
  return static_cast<std::int32_t>(value << (above - at % 2 * 4)) >> above;
}

}  // namespace rebounce
