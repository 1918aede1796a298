#pragma once

#include <span>

#include "rebounce/types.h"

namespace rebounce::bench {

/// Error of the light that patches reflect after it arrived from other patches, B - M0: relative to
/// that of `truth`, area-weighted L2 over all channels. All have n entries in lx, `area` in m².
/// Neither the light of lamps, which every method has for nothing, nor a gather more or less is in
/// it. 0 if both reflect nothing, infinite if only the truth does.
double reflected_error(std::span<const Float3> radiosity, std::span<const Float3> truth,
                       std::span<const Float3> initial_exitance, std::span<const float> area);

}  // namespace rebounce::bench
