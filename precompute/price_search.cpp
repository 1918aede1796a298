#include "price_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rebounce {
namespace {

// Logarithm of the error against that of the price: about 1/2 far from the ends, and less where the
// error has its floor or everything is left out. Bounds keep a step outwards bold but finite.
constexpr double kUsualSlope = 0.5, kLeastSlope = 0.2, kMostSlope = 1;

// A step outwards is at most this, in the logarithm of the price: a factor of a thousand.
constexpr double kLongestStep = 6.9;

// Of a bracket, at least this part is cut off by a step inside.
constexpr double kMargin = 0.1;

// Errors, in the logarithm, that differ by this much more or less than their prices explain are not
// of the same curve.
constexpr double kUneven = 0.1;

// Trials that are forgotten for it; after that, the curve itself must jump.
constexpr std::size_t kMostForgotten = 4;

// Prices this close together, in the logarithm, give the same operator or nearly so.
constexpr double kNarrow = 0.02;

}  // namespace

void PriceSearch::report(double error) {
  done_ = error >= wanted_.least && error <= wanted_.most;
  const Trial trial{std::log(price_),
                    std::log(std::max(error, std::numeric_limits<double>::min()))};
  if (forgotten_ < kMostForgotten) {
    forgotten_ += std::erase_if(trials_, [&](const Trial& old) { return contradicts(trial, old); });
  }
  const auto place = std::ranges::upper_bound(trials_, trial.price, {}, &Trial::price);
  trials_.insert(place, trial);

  const double aim = std::log(wanted_.aim);
  // Errors need not be quite monotonic: the bracket is where they first pass the aim.
  const auto high = std::ranges::find_if(trials_, [&](const Trial& t) { return t.error > aim; });
  if (high == trials_.begin()) {
    price_ = std::exp(outside(trials_.front()));
  } else if (high == trials_.end()) {
    price_ = std::exp(outside(trials_.back()));
  } else {
    const Trial& low = *(high - 1);
    done_ = done_ || high->price - low.price < kNarrow;
    price_ = std::exp(inside(low, *high));
  }
}

bool PriceSearch::contradicts(const Trial& trial, const Trial& old) {
  const double step = trial.price - old.price;
  const double rise = step > 0 ? trial.error - old.error : old.error - trial.error;
  return rise < -kUneven || rise > kMostSlope * std::abs(step) + kUneven;
}

double PriceSearch::inside(const Trial& low, const Trial& high) const {
  const double part = (std::log(wanted_.aim) - low.error) / (high.error - low.error);
  return low.price + std::clamp(part, kMargin, 1 - kMargin) * (high.price - low.price);
}

double PriceSearch::outside(const Trial& nearest) const {
  double slope = kUsualSlope;
  if (trials_.size() > 1) {
    const bool front = &nearest == &trials_.front();
    const Trial& next = front ? trials_[1] : trials_[trials_.size() - 2];
    slope = (next.error - nearest.error) / (next.price - nearest.price);
  }
  const double step =
      (std::log(wanted_.aim) - nearest.error) / std::clamp(slope, kLeastSlope, kMostSlope);
  return nearest.price + std::clamp(step, -kLongestStep, kLongestStep);
}

}  // namespace rebounce
