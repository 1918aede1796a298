#include "transfer/base/area_norm.h"

#include <cassert>
#include <cmath>
#include <limits>

namespace rebounce {

double area_norm(std::span<const Float3> values, std::span<const float> area) {
  assert(values.size() == area.size());
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (const float x : values[i]) sum += static_cast<double>(area[i]) * x * x;
  }
  return std::sqrt(sum);
}

double relative_difference(std::span<const Float3> values, std::span<const Float3> reference,
                           std::span<const float> area) {
  assert(values.size() == reference.size() && values.size() == area.size());
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = static_cast<double>(values[i][c]) - reference[i][c];
      sum += area[i] * d * d;
    }
  }
  const double norm = area_norm(reference, area);
  if (norm > 0) return std::sqrt(sum) / norm;
  return sum > 0 ? std::numeric_limits<double>::infinity() : 0;
}

}  // namespace rebounce
