#include "precompute/lights/validation_error.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

namespace rebounce {
namespace {

constexpr double kGroup = 64, kValidationConfidence = 0.95;

// A light of the sample itself needs less of a margin than those that nobody has seen (lab/103).
constexpr double kSeenPart = 0.8;

// The tail is this fraction of the sample, and at least kLeastValidationTail errors; fewer errors
// than kLeastSample give no tail.
constexpr std::size_t kValidationTailPart = 16, kLeastValidationTail = 8, kLeastSample = 32;

/// The bound that the largest of kGroup errors stays below with kValidationConfidence; `falling` is
/// sorted, largest first.
double largest_of_group(std::span<const double> falling) {
  if (falling.size() < kLeastSample) return falling.front();
  const std::size_t tail = std::max(kLeastValidationTail, falling.size() / kValidationTailPart);
  const double threshold = falling[tail];
  const auto count = static_cast<double>(tail), size = static_cast<double>(falling.size());
  const double all = std::accumulate(falling.begin(), falling.begin() + tail, 0.0);
  const double excess = all / count - threshold;
  const double beyond = 1 - std::pow(kValidationConfidence, 1 / kGroup);
  return threshold + excess * std::log(count / (size * beyond));
}

}  // namespace

double validation_error(std::span<const double> errors, double largest_over_mean) {
  std::vector<double> falling(errors.begin(), errors.end());
  std::ranges::sort(falling, std::greater<>());
  const double mean =
      std::accumulate(falling.begin(), falling.end(), 0.0) / static_cast<double>(falling.size());
  const double largest = std::max(largest_of_group(falling), kSeenPart * falling.front());
  return std::max(mean, largest / largest_over_mean);
}

}  // namespace rebounce
