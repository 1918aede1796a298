#pragma once

#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// exitance = own + reflectance irradiance, by patch and channel: M0 = Me + rho E and B = M0 + rho
/// H. All arrays have n entries; light is in lx. `exitance` may be the same array as `own` or
/// `irradiance`.
void add_reflected(std::span<const Float3> own, std::span<const Float3> reflectance,
                   std::span<const Float3> irradiance, std::span<Float3> exitance);

/// light = reflectance light, in place: turns E into M0 where nothing emits. Both have n entries.
void reflect(std::span<const Float3> reflectance, std::span<Float3> light);

}  // namespace rebounce
