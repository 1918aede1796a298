#pragma once

#include "transfer/data/sky_cells.h"

namespace rebounce {

inline constexpr int kCieSkyCount = 15;
inline constexpr int kCieOvercastSky = 1, kCieClearSky = 12;

/// The luminance of a sky of the CIE standard general sky (ISO 15469:2004): the mean of each cell,
/// relative to the zenith. `type` is its number, 1 to 15: 1 overcast, 5 uniform, 12 clear, 15
/// white-blue and turbid. `sun_direction` is the direction of the sunlight, of any length but 0.
/// The sun itself is not included; it must be above the horizon if the type is brighter around it.
/// Ground below the horizon reflects `ground_reflectance` in [0, 1] of the irradiance of the sky.
/// Throws Error if an argument is out of range.
SkyDistribution cie_sky(int type, const Float3& sun_direction, float ground_reflectance = 0.2F);

}  // namespace rebounce
