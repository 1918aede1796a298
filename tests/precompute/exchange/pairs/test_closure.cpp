#include "precompute/exchange/pairs/closure.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace rebounce::test_closure {
namespace {

TEST(Closure, RowsThatAreUncertainKeepTheirPartOfTheRestThroughAllPasses) {
  // Two pairs of patches of 1 m². The rows of the first are uncertain: with variance v of the entry
  // and 2 v of the rows the least squares change the entry by v / (v + v) of what is missing. The
  // second pair cannot close, so that no pass is the last.
  constexpr double kVariance = 5e-4, kMissing = 0.1;
  const double deviation = std::sqrt(2 * kVariance);
  ExchangeRows rows(4);
  rows[0] = {{.column = 1,
              .exchange_area = 0.5F,
              .unoccluded_area = 1,
              .visibility_variance = static_cast<float>(kVariance)}};
  rows[2] = {
      {.column = 3, .exchange_area = 0.1F, .unoccluded_area = 0.1F, .visibility_variance = 0.01F}};
  const std::array<double, 4> area{1, 1, 1, 1};
  const std::array<RowSumTarget, 4> target{
      {{0.5 + kMissing, deviation}, {0.5 + kMissing, deviation}, {1, 0}, {1, 0}}};
  const ClosureReport report = enforce_closure(rows, area, target);
  EXPECT_NEAR(rows[0][0].exchange_area, 0.5 + kMissing / 2, 1e-6);
  EXPECT_NEAR(rows[2][0].exchange_area, 0.15, 1e-6) << "at most half more";
  EXPECT_NEAR(report.row_sum_error_after, 0.85, 1e-6);
}

}  // namespace
}  // namespace rebounce::test_closure
