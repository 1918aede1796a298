#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace rebounce {

/// Chooses entries of a list with probabilities in proportion to weights.
class CumulativeChoice {
 public:
  /// Appends an entry of `weight` >= 0.
  void add(double weight) { end_.push_back(total() + weight); }

  double total() const { return end_.empty() ? 0 : end_.back(); }

  struct Chosen {
    std::size_t index;
    double rest;  ///< in [0, 1): position of the number within the chosen entry's share
  };

  /// The entry at `number` in [0, 1); never one of weight 0. total() must be positive.
  Chosen choose(double number) const {
    assert(total() > 0);
    const double place = number * total();
    // If rounding reaches the end, the last entry that has a weight.
    auto found = std::upper_bound(end_.begin(), end_.end(), place);
    if (found == end_.end()) found = std::lower_bound(end_.begin(), end_.end(), total());
    const double begin = found == end_.begin() ? 0 : *(found - 1);
    const double rest = (place - begin) / (*found - begin);
    return {static_cast<std::size_t>(found - end_.begin()), std::min(rest, kBelowOne)};
  }

 private:
  static constexpr double kBelowOne = 1 - std::numeric_limits<double>::epsilon();

  std::vector<double> end_;  // running sums of the weights
};

}  // namespace rebounce
