#include "judged_error.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

namespace rebounce {
namespace {

constexpr std::size_t kGroup = 64;

// Times the mean that an error may be: the largest of a group, and what it usually is.
constexpr double kLargestOverMean = 3, kUsualOverMean = 2.75;

}  // namespace

double judged_error(std::span<const double> errors) {
  const auto count = static_cast<double>(errors.size());
  const double mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  const double largest = std::ranges::max(errors.first(std::min(errors.size(), kGroup)));
  const double judged = std::max(mean, largest / kLargestOverMean);
  const std::size_t groups = errors.size() / kGroup;
  if (groups < 2) return judged;
  std::vector<double> sorted(errors.begin(), errors.end());
  const auto usual = sorted.begin() + static_cast<std::ptrdiff_t>(groups - 1);
  std::ranges::nth_element(sorted, usual, std::greater<>());
  return std::max(judged, *usual / kUsualOverMean);
}

}  // namespace rebounce
