#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace rebounce {

using Float2 = std::array<float, 2>;
using Float3 = std::array<float, 3>;
using Uint3 = std::array<std::uint32_t, 3>;

/// Colour channels: linear Rec.709 red, green, blue.
inline constexpr int kChannelCount = 3;

/// "No patch", "no triangle", "no texture" in index arrays.
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

}  // namespace rebounce
