#include "transfer/base/area_norm.h"

#include <cassert>
#include <cmath>
#include <limits>

namespace rebounce {

std::array<double, kChannelCount> area_inner_product(std::span<const Float3> a,
                                                     std::span<const Float3> b,
                                                     std::span<const float> area) {
  assert(a.size() == area.size() && b.size() == area.size());
  constexpr std::size_t kParts = 4;  // that do not wait for each other
  std::array<std::array<double, kChannelCount>, kParts> sum{};
  const auto add = [&](std::size_t part, std::size_t i) {
    for (int c = 0; c < kChannelCount; ++c) {
      sum[part][c] += static_cast<double>(area[i]) * a[i][c] * b[i][c];
    }
  };
  std::size_t i = 0;
  for (; i + kParts <= area.size(); i += kParts) {
    for (std::size_t part = 0; part < kParts; ++part) add(part, i + part);
  }
  for (std::size_t part = 0; i < area.size(); ++i, ++part) add(part, i);
  std::array<double, kChannelCount> result{};
  for (int c = 0; c < kChannelCount; ++c) {
    result[c] = (sum[0][c] + sum[1][c]) + (sum[2][c] + sum[3][c]);
  }
  return result;
}

double area_norm(std::span<const Float3> values, std::span<const float> area) {
  const auto [red, green, blue] = area_inner_product(values, values, area);
  return std::sqrt(red + green + blue);
}

double area_distance(std::span<const Float3> values, std::span<const Float3> reference,
                     std::span<const float> area) {
  assert(values.size() == reference.size() && values.size() == area.size());
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) {
      const double d = static_cast<double>(values[i][c]) - reference[i][c];
      sum += area[i] * d * d;
    }
  }
  return std::sqrt(sum);
}

double relative_difference(std::span<const Float3> values, std::span<const Float3> reference,
                           std::span<const float> area) {
  const double distance = area_distance(values, reference, area);
  const double norm = area_norm(reference, area);
  if (norm > 0) return distance / norm;
  return distance > 0 ? std::numeric_limits<double>::infinity() : 0;
}

}  // namespace rebounce
