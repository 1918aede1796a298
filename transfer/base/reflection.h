#pragma once

#include <span>

#include "transfer/base/types.h"

namespace rebounce {

/// exitance = own + reflectance irradiance, patch by patch and channel by channel: M0 = Me + rho E,
/// and B = M0 + rho H. All have n entries, light in lx; `exitance` may be `own` or `irradiance`.
void add_reflected(std::span<const Float3> own, std::span<const Float3> reflectance,
                   std::span<const Float3> irradiance, std::span<Float3> exitance);

/// light = reflectance light: M0 from E where nothing emits.
void reflect(std::span<const Float3> reflectance, std::span<Float3> light);

}  // namespace rebounce
