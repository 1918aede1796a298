// What the search for the tolerance makes of the errors of its judging lights.

#include "judged_error.h"

#include <gtest/gtest.h>

#include <vector>

namespace rebounce {
namespace {

/// All but some at the end the same.
std::vector<double> errors(std::size_t count, double usual, const std::vector<double>& last) {
  std::vector<double> result(count - last.size(), usual);
  result.insert(result.end(), last.begin(), last.end());
  return result;
}

TEST(JudgedError, IsTheMeanOrAThirdOfTheLargestOfAFewLights) {
  EXPECT_NEAR(judged_error(errors(12, 0.004, {})), 0.004, 1e-12);
  EXPECT_NEAR(judged_error(errors(12, 0.004, {0.03})), 0.01, 1e-12);
  EXPECT_NEAR(judged_error(errors(64, 0.004, {0.012, 0.011})), 0.264 / 64 + 0.007 / 64, 1e-5);
}

TEST(JudgedError, LooksAtTheLargestOfTheFirst64) {
  std::vector<double> many = errors(256, 0.003, {});
  many[63] = 0.03;
  EXPECT_NEAR(judged_error(many), 0.01, 1e-12);
  std::swap(many[63], many[64]);
  EXPECT_LT(judged_error(many), 0.0032) << "one of 256 says little of 64";
}

TEST(JudgedError, LooksAtWhatEvery64thLightIsAbove) {
  EXPECT_LT(judged_error(errors(256, 0.003, {0.022, 0.03, 0.04})), 0.004);
  EXPECT_NEAR(judged_error(errors(256, 0.003, {0.022, 0.03, 0.04, 0.05})), 0.008, 1e-12);
  // The same lights in another order are not judged by chance.
  EXPECT_NEAR(judged_error(errors(300, 0.003, {0.05, 0.04, 0.022, 0.03})), 0.008, 1e-12);
}

}  // namespace
}  // namespace rebounce
