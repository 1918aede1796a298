#pragma once

#include <span>

namespace rebounce {

/// What the search for the tolerance holds below a part of it: the mean of the errors or, if that
/// is more, a third of what 64 lights stay below with 95 % probability. Gates of 0.5 % in the mean
/// and 1.5 % at most over 64 lights are what it is made for. `errors`, >= 0, at least one.
///
/// That quantile is beyond most samples. It is found with a tail that falls exponentially from the
/// largest sixteenth of the errors, 8 at least, on (excesses over a threshold; A. C. Davison and
/// R. L. Smith, "Models for exceedances over high thresholds", 1990). Of fewer than 32 errors it is
/// the largest. Measured: notes/operator.md.
double validation_error(std::span<const double> errors);

}  // namespace rebounce
