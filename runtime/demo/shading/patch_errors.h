#pragma once

#include <span>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// |values - reference| of each patch over all channels, as a part of the reference's root mean
/// square over the surface; 0 where the reference is dark everywhere. All have n entries; `area` in
/// m².
std::vector<float> patch_errors(std::span<const Float3> values, std::span<const Float3> reference,
                                std::span<const float> area);

}  // namespace rebounce
