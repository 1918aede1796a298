#include "precompute/lights/error_bound.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace rebounce {
namespace {

// The part of further errors of a usual tail that may be above the bound (lab/104).
constexpr double kPartAbove = 1e-3;

// The quantile of the normal distribution at the confidence, 95 %.
constexpr double kNormalQuantile = 1.645;

// The tail is this fraction of the sample, and at least kLeastTail errors. Larger tails give lower
// bounds that fail more often in scenes with two kinds of patches (lab/049).
constexpr std::size_t kTailPart = 8, kLeastTail = 8;

/// The quantile at 5 % of a gamma distribution of shape k, relative to its mean (E. B. Wilson and
/// M. M. Hilferty, "The distribution of chi-square", 1931).
double lower_gamma_part(double k) {
  return std::pow(1 - 1 / (9 * k) - kNormalQuantile / (3 * std::sqrt(k)), 3);
}

}  // namespace

double error_bound(std::span<const double> errors) {
  std::vector<double> sorted(errors.begin(), errors.end());
  std::ranges::sort(sorted, std::greater<>());
  // An exact light is not part of the tail.
  while (!sorted.empty() && sorted.back() <= 0) sorted.pop_back();
  if (sorted.empty()) return 0;
  const std::size_t tail =
      std::min(sorted.size() - 1, std::max(kLeastTail, errors.size() / kTailPart));
  if (tail == 0) return sorted.front();
  const auto k = static_cast<double>(tail);
  double sum = 0;
  for (std::size_t i = 0; i < tail; ++i) sum += std::log(sorted[i] / sorted[tail]);
  const double index = sum / k / lower_gamma_part(k);
  const double times = k / (static_cast<double>(errors.size()) * kPartAbove);
  return std::max(sorted.front(), sorted[tail] * std::pow(std::max(1.0, times), index));
}

double part_above_bound(std::size_t count) {
  constexpr double kDoubt = 0.05;
  return 1 - std::pow(kDoubt, 1 / static_cast<double>(std::max<std::size_t>(count, 1)));
}

}  // namespace rebounce
