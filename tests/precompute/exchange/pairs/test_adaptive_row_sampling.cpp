// Which rows get more rays.

#include "precompute/exchange/pairs/adaptive_row_sampling.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace rebounce::test_adaptive_row_sampling {
namespace {

constexpr double kTolerance = 1e-3;
constexpr std::size_t kRows = 300;

/// Rows in turn right, a little too large, and far too large.
std::vector<double> sums(double little, double far) {
  std::vector<double> sum(kRows, 1.0);
  for (std::size_t i = 0; i < kRows; ++i) sum[i] += i % 3 == 1 ? little : i % 3 == 2 ? far : 0;
  return sum;
}

std::size_t count(const std::vector<bool>& rows) {
  return static_cast<std::size_t>(std::ranges::count(rows, true));
}

const std::vector<RowSumTarget> kTarget(kRows, {1, 0});

TEST(AdaptiveRowSampling, TriesSomeOfEachKind) {
  const AdaptiveRowSampling look(sums(1.5e-3, 0.1), kTarget, kTolerance);
  EXPECT_EQ(count(look.trial()), 32);
  for (std::size_t i = 0; i < kRows; i += 3) EXPECT_FALSE(look.trial()[i]);
}

TEST(AdaptiveRowSampling, GoesOnWithTheKindThatGained) {
  const AdaptiveRowSampling look(sums(1.5e-3, 0.1), kTarget, kTolerance);
  const std::vector<bool> rest = look.rest(sums(0.5e-3, 0.09));
  ASSERT_EQ(rest.size(), kRows);
  for (std::size_t i = 0; i < kRows; ++i) EXPECT_EQ(rest[i], i % 3 == 1 && !look.trial()[i]);
}

TEST(AdaptiveRowSampling, EndsWhereNoKindGained) {
  const AdaptiveRowSampling look(sums(1.5e-3, 0.1), kTarget, kTolerance);
  EXPECT_TRUE(look.rest(sums(1.4e-3, 0.1)).empty());
}

TEST(AdaptiveRowSampling, LeavesRowsAloneThatAddUp) {
  const AdaptiveRowSampling look(sums(0, 0), kTarget, kTolerance);
  EXPECT_EQ(count(look.trial()), 0);
  EXPECT_TRUE(look.rest(sums(0, 0)).empty());
}

}  // namespace
}  // namespace rebounce::test_adaptive_row_sampling
