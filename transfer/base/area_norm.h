#pragma once

#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// The area-weighted L2 norm over patches and channels: sqrt(sum over i of area(i) |v(i)|²).
/// `values` and `area` [m²] have n entries each. The sum is in double precision, in order.
double area_norm(std::span<const Float3> values, std::span<const float> area);

/// |values - reference| / |reference| in the area-weighted norm. 0 if both are 0; infinite if only
/// the reference is 0.
double relative_difference(std::span<const Float3> values, std::span<const Float3> reference,
                           std::span<const float> area);

}  // namespace rebounce
