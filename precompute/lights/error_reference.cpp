#include "precompute/lights/error_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

double ErrorReference::error(std::size_t light, double distance) const {
  const double of = reference(light);
  if (of > 0) return distance / of;
  return distance > 0 ? std::numeric_limits<double>::infinity() : 0;
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

}  // namespace rebounce
