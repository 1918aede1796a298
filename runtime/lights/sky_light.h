#pragma once

#include <cstddef>

#include "rebounce/sky.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// The irradiance in lx that patch `patch` receives directly from `sky`.
Float3 sky_irradiance(const TransferData& data, const Sky& sky, std::size_t patch);

/// The luminance of `sky` in the unit `direction`, cd/m².
Float3 sky_luminance(const Sky& sky, const Float3& direction);

/// The luminance that the cell values of `sky` are multiples of, cd/m².
Float3 sky_luminance_unit(const Sky& sky);

/// The mean luminance of `sky` above the horizon, cd/m².
Float3 mean_sky_luminance(const Sky& sky);

/// Throws Error if a number of `sky` is negative or not finite. Throws Error if it is not uniform
/// and `data` do not say how much of each of its cells the patches see.
void check_sky(const Sky& sky, const TransferData& data);

}  // namespace rebounce
