#pragma once

#include <span>

namespace rebounce {

/// A bound that, with 95 % probability, none of 1,000 further errors exceeds; they are drawn like
/// `errors`, each >= 0. Without errors: 0.
///
/// The largest eighth of the errors, k of them and at least 8, gives the index xi of the tail,
/// which is taken as a power law (B. M. Hill, "A simple general approach to inference about the
/// tail of a distribution", 1975). The upper limit of its 95 % confidence interval is used, xi (1 +
/// 1.645 / sqrt(k)). The bound is the resulting quantile beyond the sample (I. Weissman,
/// "Estimation of parameters and large quantiles based on the k largest observations", 1978): x_k
/// (k / (n p))^xi, where p is the probability that makes 1,000 errors stay below with 95 %. The
/// errors of an operator are bounded, so their tail ends sooner than a power law: the bound is on
/// the safe side.
double error_bound(std::span<const double> errors);

}  // namespace rebounce
