#pragma once

#include <vector>

namespace rebounce {

/// Stops that bring the luminances of a picture (cd/m², emitters left out) to the screen: their
/// logarithmic mean becomes a quarter of white, unless the brightest part would then be far above
/// white. 0 where all are black.
float automatic_exposure(std::vector<float> luminance);

}  // namespace rebounce
