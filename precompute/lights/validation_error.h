#pragma once

#include <span>

namespace rebounce {

/// The largest error of a light may be this multiple of the tolerance of a file, which is for the
/// mean.
inline constexpr double kLargestOverMean = 3;

/// The error that the search for the tolerance controls: the mean of the errors or, if one of these
/// is more, the bound that the errors of 64 lights stay below with 95 % probability, or 0.8 of the
/// largest error, both divided by `largest_over_mean` > 0. With 3 it fits requirements of 0.5 % in
/// the mean and 1.5 % at most over 64 lights. `errors`, each >= 0, has at least one entry.
///
/// That quantile lies beyond most samples. It follows from a tail that falls exponentially from the
/// largest sixteenth of the errors, at least 8, on (excesses over a threshold: A. C. Davison and R.
/// L. Smith, "Models for exceedances over high thresholds", 1990). For fewer than 32 errors it is
/// the largest error (lab/047). Where a few lights of a rare kind err far more than others, the
/// tail does not show it and the largest error does.
double validation_error(std::span<const double> errors, double largest_over_mean);

}  // namespace rebounce
