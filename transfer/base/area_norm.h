#pragma once

#include <array>
#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// By channel the sum over i of area(i) a(i) b(i): the area-weighted inner product. `a`, `b` and
/// `area` [m²] have n entries each. Four partial sums in double precision, of every fourth patch,
/// are added in a fixed order.
std::array<double, kChannelCount> area_inner_product(std::span<const Float3> a,
                                                     std::span<const Float3> b,
                                                     std::span<const float> area);

/// The area-weighted L2 norm over patches and channels: sqrt(sum over i of area(i) |v(i)|²).
/// `values` and `area` [m²] have n entries each.
double area_norm(std::span<const Float3> values, std::span<const float> area);

/// |values - reference| in the area-weighted norm.
double area_distance(std::span<const Float3> values, std::span<const Float3> reference,
                     std::span<const float> area);

/// |values - reference| / |reference| in the area-weighted norm. 0 if both are 0; infinite if only
/// the reference is 0.
double relative_difference(std::span<const Float3> values, std::span<const Float3> reference,
                           std::span<const float> area);

}  // namespace rebounce
