#pragma once

#include <cstddef>

namespace rebounce {

/// Floats of a coefficient: the three channels and one unused, so that they are a vector.
inline constexpr std::size_t kChannelLanes = 4;

/// Floats that the coefficients of one end of a coupling matrix take up, in whole cache lines.
constexpr std::size_t end_size(std::size_t coefficients) {
  constexpr std::size_t kOfLine = 4;
  return (coefficients + kOfLine - 1) / kOfLine * kOfLine * kChannelLanes;
}

/// Floats of scratch for a coupling matrix: room for the input coefficients of both ends.
constexpr std::size_t scratch_size(std::size_t rows, std::size_t columns) {
  return end_size(rows) + end_size(columns);
}

}  // namespace rebounce
