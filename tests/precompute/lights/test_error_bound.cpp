// The bound on unseen errors against distributions of known tails.

#include "precompute/lights/error_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace rebounce::test_error_bound {
namespace {

constexpr int kTrialCount = 200, kSampleSize = 256, kOthers = 200000;
constexpr std::uint64_t kSeed = 20240701;

/// The part of trials in which more than one in `one_in` of new errors is above the bound.
double broken_part(const std::function<double(std::mt19937_64&)>& draw, int one_in = 1000) {
  std::mt19937_64 engine(kSeed);
  std::vector<double> others(kOthers);
  for (double& e : others) e = draw(engine);
  const auto most = others.end() - kOthers / one_in;
  std::ranges::nth_element(others, most);
  int broken = 0;
  for (int trial = 0; trial < kTrialCount; ++trial) {
    std::vector<double> sample(kSampleSize);
    for (double& e : sample) e = draw(engine);
    const double bound = error_bound(sample);
    EXPECT_GE(bound, std::ranges::max(sample));
    broken += bound < *most ? 1 : 0;
  }
  return static_cast<double>(broken) / kTrialCount;
}

// Of 200 trials at 5 %, fewer than 9 % fail with a probability above 0.99.
constexpr double kMostBroken = 0.09;

TEST(ErrorBound, HoldsForTailsOfAllWeights) {
  EXPECT_LE(broken_part([](auto& e) { return std::uniform_real_distribution<>(0.5, 1)(e); }),
            kMostBroken);
  EXPECT_LE(broken_part([](auto& e) { return std::exponential_distribution<>(1)(e); }),
            kMostBroken);
  EXPECT_LE(broken_part([](auto& e) { return std::lognormal_distribution<>(0, 0.5)(e); }),
            kMostBroken);
  // Pareto with a finite variance: heavier than any operator's errors, which are bounded.
  EXPECT_LE(broken_part([](auto& e) {
              return std::pow(1 - std::uniform_real_distribution<>(0, 1)(e), -0.3);
            }),
            kMostBroken);
}

TEST(ErrorBound, HoldsForOneInEightyWhateverTheRareErrorsAre) {
  // A part of all errors is as large as no other.
  for (const double part : {0.0016, 0.0126, 0.02, 0.2}) {
    const auto draw = [part](std::mt19937_64& e) {
      const bool rare = std::uniform_real_distribution<>(0, 1)(e) < part;
      return rare ? 50.0 : std::uniform_real_distribution<>(0.5, 1)(e);
    };
    EXPECT_LE(broken_part(draw, 80), kMostBroken) << part;
    // Of one in a thousand a sample of 256 says nothing then.
    if (part < 0.01) {
      EXPECT_GT(broken_part(draw), 0.5);
    }
  }
}

TEST(ErrorBound, IsNotBeyondUse) {
  std::mt19937_64 engine(1);
  std::vector<double> sample(kSampleSize);
  for (double& e : sample) e = std::lognormal_distribution<>(0, 0.3)(engine);
  EXPECT_LT(error_bound(sample), 2 * std::ranges::max(sample));
}

TEST(ErrorBound, TakesFewErrorsAndNone) {
  EXPECT_EQ(error_bound({}), 0);
  EXPECT_EQ(error_bound(std::vector<double>{0, 0, 0}), 0);
  EXPECT_EQ(error_bound(std::vector<double>{0.25}), 0.25);
  EXPECT_GE(error_bound(std::vector<double>{0.25, 0.5, 0}), 0.5);
  EXPECT_DOUBLE_EQ(error_bound(std::vector<double>(50, 0.125)), 0.125);
}

}  // namespace
}  // namespace rebounce::test_error_bound
