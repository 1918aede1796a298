#pragma once

#include <span>

namespace rebounce {

/// A bound that no more than one in a thousand of further errors exceeds, with 95 % confidence;
/// they are drawn like `errors`, each >= 0. It is at least the largest of these. Without errors: 0.
///
/// The largest eighth of the errors, k of them and at least 8, gives the index xi of the tail,
/// which is taken as a power law (B. M. Hill, "A simple general approach to inference about the
/// tail of a distribution", 1975). The upper limit of its 95 % confidence interval is used, that
/// of a gamma distribution of shape k. The bound is the resulting quantile beyond the sample (I.
/// Weissman, "Estimation of parameters and large quantiles based on the k largest observations",
/// 1978): x_k (k / (n p))^xi with p = 1/1000. The errors of an operator are bounded, so their tail
/// ends sooner than a power law: the bound is on the safe side. What is rarer than that, such as a
/// lamp of which a hundred-thousandth arrives, shows in no sample of this size (lab/104).
double error_bound(std::span<const double> errors);

}  // namespace rebounce
