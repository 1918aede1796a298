#include "rebounce/lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace rebounce {
namespace {

/// A point between two neighbouring entries of a table.
struct Between {
  std::size_t low = 0, high = 0;
  float fraction = 0;
};

Between find(std::span<const float> angles, float angle) {
  const auto above = std::upper_bound(angles.begin(), angles.end(), angle);
  const auto high = static_cast<std::size_t>(above - angles.begin());
  if (high == 0) return {};
  if (high == angles.size()) return {high - 1, high - 1, 0};
  const float step = angles[high] - angles[high - 1];
  return {high - 1, high, (angle - angles[high - 1]) / step};
}

}  // namespace

float IntensityProfile::intensity(float vertical_angle, float horizontal_angle) const {
  if (vertical_angle < vertical.front() || vertical_angle > vertical.back()) return 0;
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  float around = horizontal_angle - kTurn * std::floor(horizontal_angle / kTurn);
  if (mirrored) {
    const float last = horizontal.back();
    around -= 2 * last * std::floor(around / (2 * last));
    around = std::min(around, 2 * last - around);
  }
  const Between v = find(vertical, vertical_angle), h = find(horizontal, around);
  const auto row = [&](std::size_t k) {
    const float* const values = candela.data() + k * vertical.size();
    return values[v.low] + v.fraction * (values[v.high] - values[v.low]);
  };
  return row(h.low) + h.fraction * (row(h.high) - row(h.low));
}

}  // namespace rebounce
