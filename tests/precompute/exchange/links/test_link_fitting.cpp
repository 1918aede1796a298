// Links made from the form factors of all pairs: as few as their error allows, and no light through
// walls.

#include "precompute/exchange/links/link_fitting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <vector>

#include "precompute/exchange/links/links.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "runtime/rays/float3_glm.h"
#include "tests/precompute/exchange/links/linked_patches.h"
#include "tests/support/expect_error.h"
#include "tests/support/random_light.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"
#include "transfer/base/area_norm.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"

namespace rebounce::test_link_fitting {
namespace {

struct Pairs {
  PatchModel model;
  ExchangeMatrix exchange;

  const PatchTable& patches() const { return model.patches; }
};

Pairs pairs_of(const Scene& scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
  ExchangeMatrix exchange = compute_form_factors(model, test::make_tracer(model)).exchange;
  return {std::move(model), std::move(exchange)};
}

FormFactorLinks fitted(const Pairs& pairs, double error_per_link = kErrorPerLink) {
  return fit_links(pairs.exchange, pairs.patches(), error_per_link);
}

/// A room with a block on its floor; more patches than a side of the blocks that links are chosen
/// in.
const Pairs& furnished() {
  static const Pairs pairs = [] {
    Scene scene = test::empty_scene();
    test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
    test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false);
    return pairs_of(scene, 600);
  }();
  return pairs;
}

std::vector<Float3> gather_pairs(const Pairs& pairs, const std::vector<Float3>& in) {
  return gather(FormFactorRows(pairs.exchange, pairs.patches().area), in);
}

std::vector<Float3> gather_links(const Pairs& pairs, const FormFactorLinks& links,
                                 const std::vector<Float3>& in) {
  return gather(*test::gathering(links, pairs.patches()), in);
}

/// Of F times light that changes from patch to patch, area-weighted L2.
double error_of(const Pairs& pairs, const FormFactorLinks& links) {
  const std::vector<Float3> light = test::random_light(pairs.patches().size(), 7);
  return relative_difference(gather_links(pairs, links, light), gather_pairs(pairs, light),
                             pairs.patches().area);
}

/// As refinement found them by rays, fewer.
FormFactorLinks traced(const Pairs& pairs) {
  const RayTracer tracer = test::make_tracer(pairs.model);
  return fit_links(LinkBuilder(pairs.model, tracer, {}).build(kLinkEpsilon).form_factors,
                   pairs.patches());
}

TEST(LinkFitting, WorthNextToNothingLinksAreThePairs) {
  const Pairs& pairs = furnished();
  const FormFactorLinks links = fitted(pairs, 1e-9);
  check_links(links, pairs.patches().size());
  EXPECT_LE(links.pair.size(), pairs.exchange.column.size());  // others have no light
  EXPECT_GE(links.pair.size(), pairs.exchange.column.size() / 4);
  EXPECT_LE(error_of(pairs, links), 2e-4);
}

TEST(LinkFitting, FewerAndTruerThanByRays) {
  const Pairs& pairs = furnished();
  const FormFactorLinks by_rays = traced(pairs), links = fitted(pairs, 1.25 * kErrorPerLink);
  const double error_by_rays = error_of(pairs, by_rays), error = error_of(pairs, links);
  std::printf("links, error of F times light: %zu, %.4f by rays; %zu, %.4f fitted\n",
              by_rays.pair.size(), error_by_rays, links.pair.size(), error);
  EXPECT_LT(links.pair.size(), by_rays.pair.size());
  EXPECT_LT(error, error_by_rays);
  EXPECT_LE(error, 0.001);
}

TEST(LinkFitting, WorthMoreLinksAreFewerAndLessTrue) {
  const Pairs& pairs = furnished();
  std::size_t count = pairs.exchange.column.size() + 1;
  double error = 0;
  for (const double error_per_link : {2e-4, 1e-3, 5e-3}) {
    const FormFactorLinks links = fitted(pairs, error_per_link);
    EXPECT_LT(links.pair.size(), count) << error_per_link;
    EXPECT_GT(error_of(pairs, links), error) << error_per_link;
    count = links.pair.size();
    error = error_of(pairs, links);
  }
}

TEST(LinkFitting, KeepsRowSums) {
  const Pairs& pairs = furnished();
  const std::vector<Float3> ones(pairs.patches().size(), {1, 1, 1});
  const auto truth = gather_pairs(pairs, ones), found = gather_links(pairs, fitted(pairs), ones);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(found[i][0], truth[i][0], 5e-3);
}

TEST(LinkFitting, NoLightThroughAWall) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {3, 3, 4}, true);
  test::add_box(scene, {3.05, 0, 0}, {6, 3, 4}, true);
  const Pairs pairs = pairs_of(scene, 500);
  const FormFactorLinks links = fitted(pairs);
  EXPECT_LT(links.pair.size(), pairs.exchange.column.size() / 2);
  const auto in_first = [&](std::size_t i) { return pairs.patches().centroid[i][0] < 3.02F; };
  std::vector<Float3> light(pairs.patches().size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (in_first(i)) light[i] = {1, 1, 1};
  }
  const auto found = gather_links(pairs, links, light);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (in_first(i)) continue;
    EXPECT_EQ(found[i][0], 0) << i;
  }
}

/// Two squares of 8 by 8 patches face to face, a metre apart, neither quite flat and neither along
/// an axis. What they exchange is uneven by a fifth.
Pairs tilted_squares() {
  constexpr std::uint32_t kSide = 8, kCount = 2 * kSide * kSide;
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uneven(-1, 1);
  const glm::dvec3 u = glm::normalize(glm::dvec3(1, -1, 0.3));
  const glm::dvec3 v = glm::normalize(glm::cross(u, glm::dvec3(0.5, 0.7, -0.4)));
  const glm::dvec3 normal = glm::cross(u, v);
  Pairs pairs;
  std::vector<std::uint64_t> begin(1, 0);
  std::vector<std::uint32_t> column;
  std::vector<float> exchange;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const bool first = i < kCount / 2;
    const double height = (first ? 0 : 1) + 1e-4 * uneven(engine);
    const glm::dvec3 place =
        (i % kSide + 0.5) / kSide * u + (i / kSide % kSide + 0.5) / kSide * v + height * normal;
    pairs.model.patches.area.push_back(1.0F / (kSide * kSide));
    pairs.model.patches.centroid.push_back(to_float3(place));
    pairs.model.patches.normal.push_back(to_float3(first ? normal : -normal));
    for (std::uint32_t j = kCount / 2; first && j < kCount; ++j) {
      column.push_back(j);
      exchange.push_back(
          static_cast<float>(0.2 * (1 + 0.2 * uneven(engine)) * std::pow(kSide, -4)));
    }
    begin.push_back(column.size());
  }
  pairs.exchange.row_begin = SharedArray<std::uint64_t>(std::move(begin));
  pairs.exchange.column = SharedArray<std::uint32_t>(std::move(column));
  pairs.exchange.exchange_area = SharedArray<float>(std::move(exchange));
  return pairs;
}

TEST(LinkFitting, RoundingOfGradientsIsSmallWhereNodesAreThin) {
  const Pairs pairs = tilted_squares();
  for (const double error_per_link : {1e-2, 3e-3}) {
    const FormFactorLinks links = fitted(pairs, error_per_link);
    EXPECT_LT(links.pair.size(), pairs.exchange.column.size() / 2);
    EXPECT_LE(error_of(pairs, links), 0.05) << error_per_link;
  }
}

TEST(LinkFitting, PatchesThatSeeThemselves) {
  Pairs pairs = furnished();
  const std::uint32_t n = static_cast<std::uint32_t>(pairs.patches().size());
  pairs.exchange.row_begin = SharedArray<std::uint64_t>([&] {
    std::vector<std::uint64_t> begin(n + 1);
    for (std::uint32_t i = 0; i <= n; ++i) begin[i] = i;
    return begin;
  }());
  std::vector<std::uint32_t> column(n);
  for (std::uint32_t i = 0; i < n; ++i) column[i] = i;
  pairs.exchange.column = SharedArray<std::uint32_t>(std::move(column));
  pairs.exchange.exchange_area = SharedArray<float>(std::vector<float>(n, 0.001F));
  const FormFactorLinks links = fitted(pairs);
  EXPECT_EQ(links.pair.size(), n);
  EXPECT_LE(error_of(pairs, links), 1e-6);
}

TEST(LinkFitting, PairsThatExchangeNextToNothing) {
  // Beside others in a sum their light is rounded away, or to less than none.
  Pairs faint{furnished().model, furnished().exchange};
  std::vector<float> exchange(faint.exchange.exchange_area.begin(),
                              faint.exchange.exchange_area.end());
  std::mt19937 random(5);
  std::uniform_real_distribution<float> magnitude(-30, 0);
  for (float& s : exchange) s *= std::pow(10.0F, magnitude(random));
  faint.exchange.exchange_area = SharedArray(std::move(exchange));
  const FormFactorLinks links = fitted(faint);
  check_links(links, faint.patches().size());
  for (const float s : links.exchange_area) ASSERT_GT(s, 0);
  EXPECT_LT(error_of(faint, links), 0.2);
}

TEST(LinkFitting, SameBitsForAnyNumberOfThreads) {
  const Pairs& pairs = furnished();
  const auto make = [&] { return fitted(pairs); };
  const FormFactorLinks one = test::with_threads(1, make), five = test::with_threads(5, make);
  EXPECT_EQ(one.pair, five.pair);
  EXPECT_EQ(one.exchange_area, five.exchange_area);
  EXPECT_EQ(one.gradient, five.gradient);
  EXPECT_EQ(one.scale, five.scale);
}

TEST(LinkFitting, StopsWhenAskedTo) {
  const Pairs& pairs = furnished();
  EXPECT_THROW(
      fit_links(pairs.exchange, pairs.patches(), kErrorPerLink, [](double) { return false; }),
      Cancelled);
}

TEST(LinkFitting, RefusesWhatDoesNotFit) {
  const Pairs& pairs = furnished();
  test::expect_error([&] { fit_links(ExchangeMatrix(), pairs.patches()); }, "differ in number");
  for (const double error_per_link : {0.0, -1e-3, std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::quiet_NaN()}) {
    test::expect_error([&] { fitted(pairs, error_per_link); }, "error_per_link");
  }
}

}  // namespace
}  // namespace rebounce::test_link_fitting
