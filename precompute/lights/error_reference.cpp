#include "precompute/lights/error_reference.h"

#include <algorithm>
#include <cmath>

#include "transfer/base/area_norm.h"

namespace rebounce {

void ErrorReference::add(double received, double all) {
  lights_.push_back({received, all});
  if (all > 0) squares_ += std::pow(received / all, 2);
}

void ErrorReference::append(const ErrorReference& other, std::size_t k) {
  add(other.lights_[k].received, other.lights_[k].all);
}

double ErrorReference::reference(std::size_t light) const {
  const double usual = std::sqrt(squares_ / static_cast<double>(lights_.size()));
  return std::max(lights_[light].received, usual * lights_[light].all);
}

double ErrorReference::part() const {
  double logarithms = 0;
  int count = 0;
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    const double reference_k = reference(k);
    if (reference_k == 0) continue;
    logarithms += std::log(reference_k / lights_[k].all);
    ++count;
  }
  return count > 0 ? std::exp(logarithms / count) : 1;
}

double received_error(std::span<const Float3> values, std::span<const Float3> truth,
                      std::span<const float> area, double reference) {
  if (reference == area_norm(truth, area)) return relative_difference(values, truth, area);
  std::vector<Float3> difference(values.begin(), values.end());
  for (std::size_t i = 0; i < difference.size(); ++i) {
    for (int c = 0; c < kChannelCount; ++c) difference[i][c] -= truth[i][c];
  }
  return area_norm(difference, area) / reference;
}

}  // namespace rebounce
