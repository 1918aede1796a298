#pragma once

#include <span>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// |values - reference| of each patch over all channels, relative to the reference's root mean
/// square over the surface. 0 if the reference is 0 everywhere. All arrays have n entries; `area`
/// is in m².
std::vector<float> patch_errors(std::span<const Float3> values, std::span<const Float3> reference,
                                std::span<const float> area);

}  // namespace rebounce
