#pragma once

// The sky: what a scene sees where it is open.

#include <array>
#include <cstdint>
#include <memory>

#include "rebounce/scene_data.h"
#include "rebounce/types.h"

namespace rebounce {

/// A number for each cell.
using SkyDistribution = std::array<float, kSkyCellCount>;

/// What is seen in every direction in which nothing is hit.
struct Sky {
  Float3 color{1, 1, 1};
  float luminance = 0;  ///< cd/m², >= 0
  /// Each >= 0: the luminance of each cell in parts of `luminance`; null: the same in all
  /// directions.
  std::shared_ptr<const SkyDistribution> distribution{};
};

/// The cell that the unit vector `direction` points to.
std::uint32_t sky_cell(const Float3& direction);

/// A point of `cell`, from 1 to 145, uniform by solid angle over [0, 1)² of `place`: a unit vector.
Float3 point_of_sky_cell(std::uint32_t cell, const Float2& place);

/// The solid angle of a cell, from 0 to 145, sr.
float sky_cell_solid_angle(std::uint32_t cell);

inline constexpr int kCieSkyCount = 15;
inline constexpr int kCieOvercastSky = 1, kCieClearSky = 12;

/// What a sky of the CIE standard general sky (ISO 15469:2004) looks like: the mean luminance of
/// each cell, where that of the zenith is 1. `type` is its number, 1 to 15: 1 overcast, 5 uniform,
/// 12 clear, 15 white-blue and turbid. `sun_direction` is the way that sunlight travels, any length
/// but 0; the sun itself is not in it, and must stand above the horizon where the type has any
/// brightness around it. Below the horizon is ground that reflects `ground_reflectance` in [0, 1]
/// of what the sky gives it. Throws Error if an argument is out of range.
SkyDistribution cie_sky(int type, const Float3& sun_direction, float ground_reflectance = 0.2F);

}  // namespace rebounce
