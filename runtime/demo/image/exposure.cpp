#include "runtime/demo/image/exposure.h"

#include <algorithm>
#include <cmath>

namespace rebounce {
namespace {

// Half a stop above the 18 % of outdoor photographs: most of a room is light walls.
constexpr double kKey = 0.25;
constexpr double kBrightShare = 0.95;  // of the pixels must stay below kBrightLevel
constexpr double kBrightLevel = 1.5;   // on the tone curve's shoulder, still with some colour
constexpr double kBlackShare = 1e-3;   // of the mean: darker pixels do not pull the exposure up

}  // namespace

float automatic_exposure(std::vector<float> luminance) {
  std::erase_if(luminance, [](float y) { return !(y >= 0) || std::isinf(y); });
  double sum = 0;
  for (const float y : luminance) sum += y;
  if (!(sum > 0)) return 0;
  const double floor = kBlackShare * sum / static_cast<double>(luminance.size());
  double log_sum = 0;
  for (const float y : luminance) log_sum += std::log(std::max<double>(y, floor));
  const double log_mean = std::exp(log_sum / static_cast<double>(luminance.size()));
  const auto rank =
      static_cast<std::ptrdiff_t>(kBrightShare * static_cast<double>(luminance.size() - 1));
  std::nth_element(luminance.begin(), luminance.begin() + rank, luminance.end());
  const double bright = luminance[static_cast<std::size_t>(rank)];
  return static_cast<float>(-std::log2(std::max(log_mean / kKey, bright / kBrightLevel)));
}

}  // namespace rebounce
