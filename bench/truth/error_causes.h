#pragma once

// What of the error of patch means is made where: in one bounce, by taking patches as evenly
// bright, and by the form factors between them.

#include <span>
#include <vector>

#include "bench/truth/pipeline_solution.h"

namespace rebounce::reference {

/// Light that patches would get if all of them were as bright as in truth, but evenly so.
struct OneBounce {
  std::vector<Float3> gathered;  ///< [n] by the form factors: F B, lx
  std::vector<Float3> traced;    ///< [n] along rays, which know F exactly but for their noise, lx
};

/// Finds it for a `solution` of which every patch was `compared` with the truth, under these
/// lights. `traced` - truth is what patches of even light cost a patch in its last bounce,
/// `gathered` - `traced` what the form factors cost it.
OneBounce find_one_bounce(const Solution& solution, const PatchComparison& compared,
                          std::span<const Light> lights, const Sky& sky, std::uint64_t seed);

}  // namespace rebounce::reference
