#pragma once

#include <span>

namespace rebounce {

/// A bound that, with 95 % probability, none of 1,000 further errors exceeds that are drawn like
/// `errors`, each >= 0. No errors: 0.
///
/// The largest eighth, k of them and 8 at least, gives the index of the tail, taken as a power
/// law (B. M. Hill, "A simple general approach to inference about the tail of a distribution",
/// 1975); of this its upper limit of 95 % confidence is used, xi (1 + 1.645 / sqrt(k)). The bound
/// is the quantile beyond the sample that it leads to (I. Weissman, "Estimation of parameters and
/// large quantiles based on the k largest observations", 1978): x_k (k / (n p))^xi, where p is the
/// probability that 1,000 errors all stay below with 95 %. Errors of an operator are bounded, so
/// that their tail ends sooner than a power law's: the bound errs to the safe side.
double error_bound(std::span<const double> errors);

}  // namespace rebounce
