// View factors of 22,000 facets: what their users wait for.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "precompute/facets/view_factors.h"
#include "tests/precompute/facets/city_facets.h"

namespace rebounce::test_view_factors_large {
namespace {

void expect_right_rows(const Facets& facets) {
  const std::clock_t begin = std::clock();
  const ViewFactors f = compute_view_factors(facets);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  const std::vector<double> sum = row_sums(f);
  double moved = 0, raw_error = 0, error = 0, blocked = 0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    raw_error =
        std::max(raw_error, std::abs(f.raw_row_sum[i] + f.raw_sky[i] + f.raw_blocked[i] - 1));
    error = std::max(error, std::abs(sum[i] + f.sky[i] + f.blocked[i] - 1));
    moved = std::max(moved, std::abs(sum[i] - f.raw_row_sum[i]));
    blocked = std::max(blocked, f.blocked[i]);
  }
  std::printf(
      "%zu facets, %zu factors, %.0f s of processor time; rows and sky off 1 by %.1e raw, "
      "%.1e closed; rows moved by %.1e; blocked %.1e\n",
      f.size(), f.factor.size(), seconds, raw_error, error, moved, blocked);
  EXPECT_LT(error, 1e-5);
  EXPECT_LT(moved, 1e-3);
  EXPECT_LT(blocked, 1e-3);
  EXPECT_LT(seconds, 2 * 200);  // on two cores
}

TEST(ViewFactorsLarge, OfAStreet) {
  expect_right_rows(test::street_canyon(2));
}

TEST(ViewFactorsLarge, OfACourtyard) {
  expect_right_rows(test::courtyard(2));
}

}  // namespace
}  // namespace rebounce::test_view_factors_large
