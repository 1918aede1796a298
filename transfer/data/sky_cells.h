#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// The directions of the sky in cells: cell 0 is all that is below the horizon, 1 to 145 are those
/// of P. R. Tregenza, "Subdivision of the sky hemisphere for luminance measurements", Lighting
/// Research and Technology 19 (1987), in the order of the daylighting programs: rows of 12 degrees
/// of altitude from the horizon up, each from north clockwise (seen from above), its first cell
/// around north; the last cell is the zenith. Up is +y, north -z, east +x.
inline constexpr std::uint32_t kSkyCellCount = 146;

/// A number for each cell.
using SkyDistribution = std::array<float, kSkyCellCount>;

/// The cell that the unit vector `direction` points to.
std::uint32_t sky_cell(const Float3& direction);

/// A point of `cell`, which is not 0, uniform by solid angle over [0, 1)² of `place`: a unit
/// vector.
Float3 point_of_sky_cell(std::uint32_t cell, const Float2& place);

/// The solid angle of a cell, sr.
float sky_cell_solid_angle(std::uint32_t cell);

/// How much of each cell the patches see.
struct SkyCells {
  /// Those that patch i sees are [entry_begin[i], entry_begin[i + 1]), ascending.
  std::vector<std::uint32_t> entry_begin;  ///< [n + 1]
  std::vector<std::uint8_t> entry_cell;
  /// Cosine-weighted fraction of the patch's view, (0, 1]: their sum is the patch's sky_visibility.
  std::vector<float> entry_part;

  bool empty() const { return entry_begin.empty(); }
};

}  // namespace rebounce
