#include "precompute/lights/error_bound.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace rebounce {
namespace {

constexpr double kOtherLights = 1000, kConfidence = 0.95;

// The quantile of the normal distribution at kConfidence.
constexpr double kNormalQuantile = 1.645;

// The tail is this fraction of the sample, and at least kLeastTail errors. Larger tails give lower
// bounds that fail more often in scenes with two kinds of patches (lab/049).
constexpr std::size_t kTailPart = 8, kLeastTail = 8;

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
  const double index = sum / k * (1 + kNormalQuantile / std::sqrt(k));
  const double p = 1 - std::pow(kConfidence, 1 / kOtherLights);
  return sorted[tail] * std::pow(k / (static_cast<double>(errors.size()) * p), index);
}

}  // namespace rebounce
