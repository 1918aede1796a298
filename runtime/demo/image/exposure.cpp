#include "runtime/demo/image/exposure.h"

#include <algorithm>
#include <cmath>

#include "rebounce/error.h"

namespace rebounce {
namespace {

// Half a stop above the 18 % of outdoor photographs: walls of rooms are mostly light.
constexpr double kKey = 0.25;
constexpr double kBrightShare = 0.95;  // fraction of the pixels that must stay below kBrightLevel
constexpr double kBrightLevel =
    1.5;  // on the shoulder of the tone curve, where some colour is left
constexpr double kBlackShare =
    1e-3;  // relative to the mean: darker pixels do not raise the exposure

}  // namespace

void check_exposure(float stops) {
  constexpr float kMostStops = 64;
  if (!(std::abs(stops) <= kMostStops)) throw Error("an exposure must be from -64 to 64 stops");
}

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
