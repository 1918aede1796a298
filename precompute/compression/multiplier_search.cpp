#include "precompute/compression/multiplier_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rebounce {
namespace {

// Bounds of the slope of the logarithm of the error over that of the multiplier. They keep a step
// outwards bold but finite.
constexpr double kLeastSlope = 0.2, kMostSlope = 1;

// Minus the slope of the logarithm of the size over that of the multiplier: 0.2 to 0.5 for
// operators that are applied, 0.05 to 0.2 for form factors (lab/037).
constexpr double kUsualShrinking = 0.3, kLeastShrinking = 0.05, kMostShrinking = 1;

// The longest step outwards, in the logarithm of the multiplier: a factor of a thousand.
constexpr double kLongestStep = 6.9;

// A step inside a bracket cuts off at least this fraction.
constexpr double kMargin = 0.1;

// Errors whose logarithms differ by this much more or less than their multipliers explain are not
// of the same curve.
constexpr double kUneven = 0.1;

// The most trials that are dropped because of it. After that, the curve itself must have a jump.
constexpr std::size_t kMostForgotten = 4;

// Multipliers whose logarithms are this close give about the same operator.
constexpr double kNarrow = 0.02;

}  // namespace

void MultiplierSearch::report(double error, double size) {
  const Trial trial{std::log(multiplier_),
                    std::log(std::max(error, std::numeric_limits<double>::min())), std::log(size)};
  if (error <= wanted_.most) smallest_ = std::min(smallest_, trial.size);
  if (forgotten_ < kMostForgotten) {
    forgotten_ += std::erase_if(trials_, [&](const Trial& old) { return contradicts(trial, old); });
  }
  const auto place = std::ranges::upper_bound(trials_, trial.multiplier, {}, &Trial::multiplier);
  trials_.insert(place, trial);

  // Errors need not be monotonic: the bracket is where they first pass the aim.
  const double aim = std::log(wanted_.aim);
  const auto high = std::ranges::find_if(trials_, [&](const Trial& t) { return t.error > aim; });
  const bool bracketed = high != trials_.begin() && high != trials_.end();
  const Next next = bracketed                 ? inside(*(high - 1), *high)
                    : high == trials_.begin() ? outside(trials_.front())
                                              : outside(trials_.back());
  multiplier_ = std::exp(next.multiplier);
  const bool narrow = bracketed && high->multiplier - (high - 1)->multiplier < kNarrow;
  done_ = narrow || next.size > smallest_ + std::log1p(-expected_.least_saving);
}

bool MultiplierSearch::contradicts(const Trial& trial, const Trial& old) {
  const double step = trial.multiplier - old.multiplier;
  const double rise = step > 0 ? trial.error - old.error : old.error - trial.error;
  return rise < -kUneven || rise > kMostSlope * std::abs(step) + kUneven;
}

/// The size at `multiplier`, on the line through two trials.
double MultiplierSearch::size_at(double multiplier, const Trial& from, const Trial& to) {
  const double shrinking = (from.size - to.size) / (to.multiplier - from.multiplier);
  return from.size -
         std::clamp(shrinking, kLeastShrinking, kMostShrinking) * (multiplier - from.multiplier);
}

MultiplierSearch::Next MultiplierSearch::inside(const Trial& low, const Trial& high) const {
  const double part = (std::log(wanted_.aim) - low.error) / (high.error - low.error);
  const auto multiplier = [&](double of_bracket) {
    return low.multiplier + of_bracket * (high.multiplier - low.multiplier);
  };
  return {multiplier(std::clamp(part, kMargin, 1 - kMargin)), size_at(multiplier(part), low, high)};
}

MultiplierSearch::Next MultiplierSearch::outside(const Trial& nearest) const {
  const double left = std::log(wanted_.aim) - nearest.error;
  const auto reached = [&](double slope) {
    return nearest.multiplier + std::clamp(left / slope, -kLongestStep, kLongestStep);
  };
  if (trials_.size() == 1) {
    const double multiplier = reached(expected_.slope);
    return {multiplier, nearest.size - kUsualShrinking * (multiplier - nearest.multiplier)};
  }
  const bool front = &nearest == &trials_.front();
  const Trial& next = front ? trials_[1] : trials_[trials_.size() - 2];
  const double slope = (next.error - nearest.error) / (next.multiplier - nearest.multiplier);
  const double multiplier = reached(std::clamp(slope, kLeastSlope, kMostSlope));
  return {multiplier, size_at(multiplier, nearest, next)};
}

}  // namespace rebounce
