#pragma once

#include <cstddef>
#include <span>

namespace rebounce {

/// A bound on further errors that are drawn like `errors`, each >= 0. It is at least the largest of
/// these. Without errors: 0. It says two things, each with 95 % confidence:
///
/// - Of any errors whatever, no more than a part 1 - 0.05^(1/n) of further ones is above the
/// largest
///   of n, and so above the bound (S. Wilks, "Determination of sample sizes for setting tolerance
///   limits", 1941): one in 80 from n = 240 on.
/// - Where the tail is a power law, or ends sooner, no more than one in a thousand is. The largest
///   eighth of the errors, k of them and at least 8, gives its index xi (B. M. Hill, "A simple
///   general approach to inference about the tail of a distribution", 1975). The upper limit of its
///   95 % confidence interval is used, that of a gamma distribution of shape k. The bound is the
///   resulting quantile beyond the sample (I. Weissman, "Estimation of parameters and large
///   quantiles based on the k largest observations", 1978): x_k (k / (n p))^xi with p = 1/1000.
///
/// What is rarer than the sample shows and of another kind, such as a lamp on one patch of which a
/// hundred-thousandth arrives, breaks the second and not the first (lab/115).
double error_bound(std::span<const double> errors);

/// The part of further errors that may be above the bound of `count` of them, whatever they are:
/// the first of the statements above.
double part_above_bound(std::size_t count);

}  // namespace rebounce
