// The search for the multiplier against error curves of known shapes.

#include "precompute/compression/multiplier_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace rebounce::test_multiplier_search {
namespace {

constexpr MultiplierSearch::Range kWanted{0.72, 0.8};
constexpr double kSlope = 0.5, kLeastSaving = 0.03;

// Errors of less leave more to save than is left, along kShrinking.
constexpr double kShrinking = 0.3, kLeastGood = 0.65;

/// The smallest of what is good.
struct Found {
  double error = 0, size = std::numeric_limits<double>::infinity();
  int rounds = 0;
};

Found search(double initial_multiplier, const std::function<double(double)>& error_of,
             double least_saving = kLeastSaving) {
  MultiplierSearch search(initial_multiplier, kWanted, {kSlope, least_saving});
  Found found;
  while (!search.done() && found.rounds < 50) {
    const double multiplier = search.multiplier();
    const double error = error_of(multiplier), size = std::pow(multiplier, -kShrinking);
    if (error <= kWanted.most && size < found.size) {
      found.error = error;
      found.size = size;
    }
    search.report(error, size);
    ++found.rounds;
  }
  return found;
}

void expect_good(const Found& found, int most_rounds) {
  EXPECT_GE(found.error, kLeastGood);
  EXPECT_LE(found.error, kWanted.most);
  EXPECT_LE(found.rounds, most_rounds);
}

TEST(MultiplierSearch, EndsSoonerWhereLittleSavingIsNotWanted) {
  const auto error_of = [](double multiplier) { return 0.7 * std::sqrt(multiplier); };
  // From errors of 0.35 on, sizes may fall by a third.
  const Found usual = search(0.25, error_of), rough = search(0.25, error_of, 0.5);
  EXPECT_EQ(rough.rounds, 1);
  EXPECT_GT(usual.rounds, 1);
  EXPECT_LT(usual.size, 0.75 * rough.size);
}

TEST(MultiplierSearch, FindsARootInOneStepFromAnywhereWithinReach) {
  for (const double first : {0.001, 1.0, 500.0}) {
    expect_good(search(first, [](double multiplier) { return std::sqrt(multiplier); }), 2);
  }
}

TEST(MultiplierSearch, LearnsAnotherSlope) {
  for (const double power : {0.3, 0.4, 0.7, 0.9}) {
    for (const double first : {1e-3, 1e3}) {
      SCOPED_TRACE(power);
      expect_good(search(first, [=](double multiplier) { return std::pow(multiplier, power); }), 6);
    }
  }
}

TEST(MultiplierSearch, CrossesManyOrdersOfMagnitude) {
  expect_good(search(1e-12, [](double multiplier) { return std::sqrt(multiplier); }), 6);
  expect_good(search(1e12, [](double multiplier) { return std::sqrt(multiplier); }), 6);
}

TEST(MultiplierSearch, BendsWithAFloorAndACeiling) {
  // As operators do: rounding below, everything left out above.
  const auto error = [](double multiplier) {
    return std::clamp(3 * std::pow(multiplier, 0.6), 0.2, 100.0);
  };
  for (const double first : {1e-6, 1e-2, 1.0, 1e4}) expect_good(search(first, error), 8);
}

/// Whether a search ends at an error of 0.6 that a second trial gives, of so much of the size of
/// the first, whose error was half of it.
bool ends_at(double part_of_size) {
  MultiplierSearch search(1, kWanted, {kSlope, kLeastSaving});
  search.report(0.3, 1000);
  EXPECT_FALSE(search.done());
  search.report(0.6, 1000 * part_of_size);
  return search.done();
}

TEST(MultiplierSearch, EndsWhereAnotherTrialWouldSaveLittle) {
  EXPECT_TRUE(ends_at(0.95));
  EXPECT_FALSE(ends_at(0.6));
}

TEST(MultiplierSearch, DoesNotEndWhileNoErrorWasGood) {
  MultiplierSearch search(1, kWanted, {kSlope, kLeastSaving});
  for (const double error : {5.0, 3.0, 2.0, 0.81}) {
    search.report(error, 1000);
    EXPECT_FALSE(search.done()) << error;
  }
  search.report(0.79, 1000);
  EXPECT_TRUE(search.done());
}

TEST(MultiplierSearch, StopsAtAJumpThatHasNoGoodError) {
  const Found found = search(1, [](double multiplier) { return multiplier < 7 ? 0.1 : 5.0; });
  EXPECT_LT(found.rounds, 40);
}

TEST(MultiplierSearch, ForgetsWhatTheWeightsBeforeGave) {
  // The first trial errs ten times as much as it would with the weights of all later ones.
  int round = 0;
  const auto error = [&](double multiplier) {
    return (round++ == 0 ? 10 : 1) * std::sqrt(multiplier);
  };
  for (const double first : {0.01, 0.5, 20.0}) {
    round = 0;
    expect_good(search(first, error), 5);
  }
}

TEST(MultiplierSearch, LeavesAnErrorOfNothing) {
  expect_good(
      search(1e-9, [](double multiplier) { return multiplier < 1e-3 ? 0 : std::sqrt(multiplier); }),
      10);
}

}  // namespace
}  // namespace rebounce::test_multiplier_search
