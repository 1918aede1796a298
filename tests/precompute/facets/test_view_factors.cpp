#include "precompute/facets/view_factors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "precompute/facets/exchange_factors.h"
#include "tests/precompute/facets/city_facets.h"
#include "tests/support/expect_error.h"
#include "tests/support/view_factor_table.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_view_factors {
namespace {

using Polygon = std::vector<glm::dvec3>;

void add_facet(Facets& facets, const Polygon& polygon) {
  std::vector<std::uint32_t> corners(polygon.size());
  std::iota(corners.begin(), corners.end(), static_cast<std::uint32_t>(facets.vertex.size()));
  facets.vertex.insert(facets.vertex.end(), polygon.begin(), polygon.end());
  facets.add(corners);
}

Facets facets_of(const std::vector<Polygon>& polygons) {
  Facets facets;
  for (const Polygon& polygon : polygons) add_facet(facets, polygon);
  return facets;
}

/// The faces of a box; `inwards`: seen from inside.
std::vector<Polygon> box(const glm::dvec3& low, const glm::dvec3& high, bool inwards) {
  std::vector<Polygon> faces;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upper : {false, true}) {
      Polygon face(4, upper ? high : low);
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int k = 0; k < 4; ++k) {
        face[k][u] = k == 1 || k == 2 ? high[u] : low[u];
        face[k][v] = k >= 2 ? high[v] : low[v];
      }
      if (upper == inwards) std::ranges::reverse(face);
      faces.push_back(face);
    }
  }
  return faces;
}

double factor(const ViewFactors& f, std::size_t i, std::uint32_t j) {
  for (std::uint64_t k = f.row_begin[i]; k < f.row_begin[i + 1]; ++k) {
    if (f.column[k] == j) return f.factor[k];
  }
  return 0;
}

void expect_sane(const ViewFactors& f, double tolerance = 1e-5) {
  const std::vector<double> sum = row_sums(f);
  for (std::size_t i = 0; i < f.size(); ++i) {
    ASSERT_NEAR(sum[i] + f.sky[i] + f.blocked[i], 1, tolerance) << i;
    for (std::uint64_t k = f.row_begin[i]; k < f.row_begin[i + 1]; ++k) {
      const std::uint32_t j = f.column[k];
      ASSERT_NE(i, j);
      ASSERT_GT(f.factor[k], 0);
      ASSERT_LE(f.factor[k], 1);
      ASSERT_LE(f.area[i] * f.factor[k], std::min(f.area[i], f.area[j]) * (1 + 1e-15));
      ASSERT_NEAR(f.area[i] * f.factor[k], f.area[j] * factor(f, j, static_cast<std::uint32_t>(i)),
                  1e-15 * f.area[i]);
    }
  }
}

class ViewFactorTable : public testing::TestWithParam<FormFactorQuality> {};

TEST_P(ViewFactorTable, AgreesWithEveryRow) {
  const double tolerance = GetParam() == FormFactorQuality::kHigh ? 1e-3 : 5e-3;
  const auto cases =
      test::read_view_factors(REBOUNCE_SOURCE_DIR "/tests/reference/view_factors.tsv");
  ASSERT_GT(cases.size(), 30U);
  for (const test::ViewFactorCase& c : cases) {
    if (c.id.starts_with("INF")) continue;  // the kernel's test has those: strips 20 km long
    const ViewFactors f = compute_view_factors(facets_of({c.a, c.b}), {.quality = GetParam()});
    ASSERT_EQ(f.size(), 2U);
    EXPECT_NEAR(factor(f, 0, 1), c.factor, std::max((tolerance + c.model_error) * c.factor, 1e-9))
        << c.id;
  }
}

INSTANTIATE_TEST_SUITE_P(Qualities, ViewFactorTable,
                         testing::Values(FormFactorQuality::kDefault, FormFactorQuality::kHigh));

TEST(ViewFactors, AreTheSameWhereFacetsAreCut) {
  // A third facet, out of sight, has the others cut.
  const Polygon aside = {{50, 50, 50}, {50, 51, 50}, {51, 50, 50}};
  const auto cases =
      test::read_view_factors(REBOUNCE_SOURCE_DIR "/tests/reference/view_factors.tsv");
  for (const test::ViewFactorCase& c : cases) {
    if (!c.id.starts_with("PAR_1x1_c1") && !c.id.starts_with("PERP_h1_w2")) continue;
    const ViewFactors f =
        compute_view_factors(facets_of({c.a, c.b, aside}), {.quality = FormFactorQuality::kLow});
    EXPECT_GT(f.patch_count, 500U);
    EXPECT_NEAR(factor(f, 0, 1), c.factor, std::max(5e-3 * c.factor, 1e-9)) << c.id;
  }
}

TEST(ViewFactors, OfABoxAddUpToOne) {
  const ViewFactors f = compute_view_factors(facets_of(box({0, 0, 0}, {1, 2, 3}, true)),
                                             {.quality = FormFactorQuality::kLow, .closed = true});
  expect_sane(f);
  for (const double sum : row_sums(f)) EXPECT_NEAR(sum, 1, 1e-5);
  for (const double sky : f.sky) EXPECT_EQ(sky, 0);
}

TEST(ViewFactors, SeeAPlateBetweenTwoSquares) {
  // A plate half as large in the middle hides what crosses it: 0.5 x 0.5 at half the distance.
  Facets facets = facets_of({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                             {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}},
                             {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}}});
  facets.obstructs_only = {0, 0, 1};
  const ViewFactors f = compute_view_factors(facets, {.quality = FormFactorQuality::kLow});
  EXPECT_EQ(f.size(), 3U);
  EXPECT_LT(factor(f, 0, 1), 1e-4);
  // The plate takes what two squares at half the distance exchange.
  EXPECT_NEAR(f.blocked[0], 0.415253, 4e-3);
  EXPECT_NEAR(f.sky[0], 1 - 0.415253, 4e-3);
  EXPECT_EQ(f.row_begin[3], f.row_begin[2]);
}

TEST(ViewFactors, OfConcaveFacets) {
  // An L on the floor under a ceiling: what its three squares have together.
  const Polygon ceiling = {{0, 0, 1}, {0, 2, 1}, {2, 2, 1}, {2, 0, 1}};
  const ViewFactors whole = compute_view_factors(
      facets_of({ceiling, {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}}}));
  const ViewFactors parts =
      compute_view_factors(facets_of({ceiling,
                                      {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}},
                                      {{0, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}}}));
  EXPECT_NEAR(whole.area[1], 3, 1e-12);
  EXPECT_NEAR(factor(whole, 0, 1), factor(parts, 0, 1) + factor(parts, 0, 2), 1e-4);
}

TEST(ViewFactors, CornersThatFallTogetherCountOnce) {
  // Of two unit squares a metre apart one has a corner twice. A third facet has them cut.
  const Polygon above = {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};
  const Polygon aside = {{50, 50, 50}, {50, 51, 50}, {51, 50, 50}};
  for (const double between : {0.0, 1e-9}) {
    const Polygon below = {{0, 0, 0}, {1, 0, 0}, {1, between, 0}, {1, 1, 0}, {0, 1, 0}};
    const ViewFactors f = compute_view_factors(facets_of({below, above, aside}),
                                               {.quality = FormFactorQuality::kLow});
    EXPECT_NEAR(factor(f, 0, 1), 0.199825, 1e-3) << between;
  }
}

TEST(ViewFactors, VerticesWithoutAFacetChangeNothing) {
  Facets facets = facets_of(box({0, 0, 0}, {1, 2, 3}, true));
  const auto compute = [&] {
    return compute_view_factors(facets, {.quality = FormFactorQuality::kLow});
  };
  const ViewFactors before = compute();
  facets.vertex.emplace_back(1e7, 1e7, 1e7);
  const ViewFactors after = compute();
  EXPECT_EQ(before.factor, after.factor);
  EXPECT_EQ(before.sky, after.sky);
}

TEST(ViewFactors, OfAStreetAreRightWithoutRepair) {
  const ViewFactors f = compute_view_factors(test::street_canyon(1));
  ASSERT_GT(f.size(), 5000U);
  expect_sane(f);
  const std::vector<double> sum = row_sums(f);
  double moved = 0, raw_error = 0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    moved = std::max(moved, std::abs(sum[i] - f.raw_row_sum[i]));
    raw_error =
        std::max(raw_error, std::abs(f.raw_row_sum[i] + f.raw_sky[i] + f.raw_blocked[i] - 1));
    ASSERT_LT(f.blocked[i], 1e-3) << i;
  }
  RecordProperty("moved", std::to_string(moved));
  EXPECT_LT(moved, 1e-3);
  EXPECT_LT(raw_error, 0.02);
}

TEST(ViewFactors, SameBitsForAnyNumberOfThreads) {
  const Facets facets = facets_of(box({0, 0, 0}, {1, 2, 3}, true));
  const auto make = [&] {
    return compute_view_factors(facets, {.quality = FormFactorQuality::kLow});
  };
  const ViewFactors one = test::with_threads(1, make), three = test::with_threads(3, make);
  EXPECT_EQ(one.factor, three.factor);
  EXPECT_EQ(one.sky, three.sky);
}

TEST(ViewFactors, DropSmallPairsInBothDirections) {
  ViewFactors f =
      compute_view_factors(test::street_canyon(1), {.quality = FormFactorQuality::kLow});
  const std::vector<double> before = row_sums(f);
  const std::size_t count = f.factor.size();
  const DroppedFactors dropped = drop_small_factors(f, 1e-4);
  EXPECT_EQ(f.factor.size() + 2 * dropped.pair_count, count);
  EXPECT_GT(dropped.pair_count, 1000U);
  EXPECT_LE(dropped.largest_row_loss, 5e-4);
  const std::vector<double> after = row_sums(f);
  for (std::size_t i = 0; i < f.size(); ++i) ASSERT_LE(before[i] - after[i], 5e-4 + 1e-12);
  expect_sane(f, 6e-4);
}

TEST(ViewFactors, RefuseWhatTheyCannotUse) {
  using test::expect_error;
  const auto compute = [](const Facets& facets, bool closed = false) {
    return [=] {
      compute_view_factors(facets, {.quality = FormFactorQuality::kLow, .closed = closed});
    };
  };
  const Polygon square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  expect_error(compute(Facets{}), "no facets");
  expect_error(compute(facets_of({square, {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}})),
               "facet 2 has no area");
  expect_error(compute(facets_of({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.2}, {0, 1, 0}}})),
               "facet 1 is not flat");
  expect_error(compute(facets_of({{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0.5, 1.5, 0}, {0, 1, 0}}})),
               "facet 1 crosses itself");
  expect_error(compute(facets_of({{{0, 0, 0}, {3, 0, 0}, {0.5, 1, 0}, {3, 3, 0}}})),
               "facet 1 crosses itself");
  const Polygon above = {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};
  expect_error(compute(facets_of({square, above, {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1e-9, 0.5}}})),
               "facet 3 is too thin for single precision");
  Facets facets = facets_of({square});
  facets.corner[1] = 9;
  expect_error(compute(facets), "facet 1 names vertex 10 of 4");
  std::vector<Polygon> open = box({0, 0, 0}, {1, 1, 1}, true);
  open.pop_back();
  expect_error(compute(facets_of(open), true), "no enclosure");
}

TEST(ExchangeFactors, OfAGreyBoxSatisfyTheirEquation) {
  const ViewFactors f = compute_view_factors(facets_of(box({0, 0, 0}, {1, 2, 3}, true)),
                                             {.quality = FormFactorQuality::kLow, .closed = true});
  const std::vector<double> emissivity = {0.3, 0.5, 0.9, 1, 0.7, 0.05};
  const ExchangeFactors g = compute_exchange_factors(f, emissivity);
  for (std::uint32_t i = 0; i < 6; ++i) {
    double sum = g.sky[i];
    for (std::uint32_t j = 0; j < 6; ++j) {
      // G = F e + F (1 - e) G (B. Gebhart).
      double right = factor(f, i, j) * emissivity[j];
      for (std::uint32_t k = 0; k < 6; ++k) {
        right += factor(f, i, k) * (1 - emissivity[k]) * g.factor[k * 6 + j];
      }
      EXPECT_NEAR(g.factor[i * 6 + j], right, 1e-5);
      EXPECT_NEAR(f.area[i] * emissivity[i] * g.factor[i * 6 + j],
                  f.area[j] * emissivity[j] * g.factor[j * 6 + i], 1e-5);
      sum += g.factor[i * 6 + j];
    }
    EXPECT_NEAR(sum, 1, 1e-4);
  }
  test::expect_error([&] { compute_exchange_factors(f, std::vector<double>(5, 0.5)); },
                     "5 emissivities for 6 facets");
  test::expect_error([&] { compute_exchange_factors(f, std::vector<double>(6, 0.0)); },
                     "facet 1 is not in [0.01, 1]");
}

TEST(ExchangeFactors, RefuseViewFactorsThatCannotBe) {
  const ViewFactors right = compute_view_factors(facets_of(box({0, 0, 0}, {1, 2, 3}, true)),
                                                 {.quality = FormFactorQuality::kLow});
  const auto expect_refused = [&](const auto& change, const std::string& why) {
    ViewFactors wrong = right;
    change(wrong);
    test::expect_error([&] { compute_exchange_factors(wrong, std::vector<double>(6, 0.5)); }, why);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double area : {0.0, -1.0, nan}) {
    expect_refused([=](ViewFactors& f) { f.area[1] = area; }, "the area of facet 2 is not");
  }
  for (const double factor : {-0.1, nan}) {
    expect_refused([=](ViewFactors& f) { f.factor[0] = factor; },
                   "the view factor from facet 1 to facet 2 is not a number from 0 on");
  }
  // The last row is in the lower triangle alone.
  expect_refused([](ViewFactors& f) { f.factor.back() *= 1.01; },
                 "the view factor from facet 5 to facet 6 and the one back differ");
  ViewFactors single = right;
  for (double& factor : single.factor) factor = static_cast<float>(factor);
  EXPECT_NO_THROW(compute_exchange_factors(single, std::vector<double>(6, 0.5)));
}

}  // namespace
}  // namespace rebounce::test_view_factors
