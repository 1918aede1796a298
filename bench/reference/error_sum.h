#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "bench/reference/compare.h"
#include "rebounce/types.h"

namespace rebounce::reference {

/// Adds up squared differences from an estimated truth.
class ErrorSum {
 public:
  void add(double weight, const Float3& value, const Float3& truth, const Float3& standard_error) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      const double difference = static_cast<double>(value[c]) - truth[c];
      const double deviation = standard_error[c];
      measured_ += weight * difference * difference;
      noise_ += weight * deviation * deviation;
      truth_ += weight * truth[c] * truth[c];
    }
    ++count_;
  }

  std::size_t count() const { return count_; }

  /// No error where there is neither light nor difference; an infinite one where there is only a
  /// difference.
  RelativeError result(std::size_t left_out_count) const {
    const double truth = std::sqrt(std::max(0.0, truth_ - noise_));
    const auto relative = [truth](double squared) {
      return squared > 0 ? std::sqrt(squared) / truth : 0;
    };
    return {relative(measured_ - noise_), relative(noise_), count_, left_out_count};
  }

 private:
  double measured_ = 0, noise_ = 0, truth_ = 0;
  std::size_t count_ = 0;
};

}  // namespace rebounce::reference
