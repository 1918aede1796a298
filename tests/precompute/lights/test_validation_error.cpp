// What the search for the tolerance makes of the errors of its validation lights.

#include "precompute/lights/validation_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace rebounce::test_validation_error {
namespace {

/// All but some at the end the same.
std::vector<double> errors(std::size_t count, double usual, const std::vector<double>& last) {
  std::vector<double> result(count - last.size(), usual);
  result.insert(result.end(), last.begin(), last.end());
  return result;
}

TEST(ValidationError, IsTheMeanOrAThirdOfTheLargestOfAFewLights) {
  EXPECT_NEAR(validation_error(errors(12, 0.004, {}), 3), 0.004, 1e-12);
  EXPECT_NEAR(validation_error(errors(12, 0.004, {0.03}), 3), 0.01, 1e-12);
  EXPECT_NEAR(validation_error(errors(1, 0.004, {}), 3), 0.004, 1e-12);
}

TEST(ValidationError, IsTheMeanWhereAllErrorsAreAlike) {
  for (const std::size_t count : {32, 64, 256, 1000}) {
    EXPECT_NEAR(validation_error(errors(count, 0.004, {}), 3), 0.004, 1e-12);
  }
}

TEST(ValidationError, FindsWhatTheLargestOf64LightsIsOfAnExponentialTail) {
  // 64 of them stay below s log(64 / -log 0.95) with 95 %: 7.13 s.
  for (const std::size_t count : {64, 256, 4096}) {
    double sum = 0;
    constexpr int kSamples = 200;
    std::mt19937_64 engine(count);
    std::exponential_distribution<double> error(1 / 0.003);
    for (int sample = 0; sample < kSamples; ++sample) {
      std::vector<double> drawn(count);
      for (double& e : drawn) e = error(engine);
      sum += validation_error(drawn, 3);
    }
    EXPECT_NEAR(sum / kSamples, 7.13 * 0.003 / 3, 0.08 * 7.13 * 0.003 / 3) << count << " lights";
  }
}

TEST(ValidationError, SeesASingleLightThatTheTailDoesNot) {
  EXPECT_NEAR(validation_error(errors(512, 0.0009, {0.032}), 3), 0.8 * 0.032 / 3, 1e-12);
}

TEST(ValidationError, AllowsTheLargestMoreAndTheMeanTheSame) {
  EXPECT_NEAR(validation_error(errors(12, 0.004, {0.03}), 4), 0.0075, 1e-12);
  EXPECT_NEAR(validation_error(errors(512, 0.0009, {0.032}), 4), 0.8 * 0.032 / 4, 1e-12);
  EXPECT_NEAR(validation_error(errors(512, 0.004, {0.006}), 100), 0.004, 1e-5);
}

TEST(ValidationError, DoesNotDependOnTheOrder) {
  std::vector<double> many = errors(256, 0.003, {0.022, 0.03, 0.04, 0.05});
  const double judged = validation_error(many, 3);
  EXPECT_GT(judged, 0.004);
  std::ranges::reverse(many);
  EXPECT_EQ(validation_error(many, 3), judged);
}

}  // namespace
}  // namespace rebounce::test_validation_error
