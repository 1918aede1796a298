#pragma once

#include "transfer/data/sky_cells.h"

namespace rebounce {

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
