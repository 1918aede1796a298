#pragma once

#include <vector>

namespace rebounce {

/// The exposure in stops for a picture with these luminances (cd/m², without emitters). The
/// logarithmic mean becomes a quarter of white, unless the brightest part would then be far above
/// white. 0 if all are black.
float automatic_exposure(std::vector<float> luminance);

/// Throws Error unless an exposure is from -64 to 64 stops, where light keeps its range.
void check_exposure(float stops);

}  // namespace rebounce
