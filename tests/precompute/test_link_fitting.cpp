// Links made from the form factors of all pairs: as true as asked, and no light through walls.

#include "rebounce/precompute/link_fitting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "expect_error.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/linked_form_factors.h"
#include "random_light.h"
#include "test_scenes.h"
#include "with_threads.h"

namespace rebounce {
namespace {

struct Pairs {
  PatchTable patches;
  ExchangeMatrix exchange;
};

Pairs pairs_of(const Scene& scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
  ExchangeMatrix exchange = compute_form_factors(model, test::make_tracer(model)).exchange;
  return {std::move(model.patches), std::move(exchange)};
}

/// A room with a block on its floor.
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
  return gather(FormFactorRows(pairs.exchange, pairs.patches.area), in);
}

std::vector<Float3> gather_links(const Pairs& pairs, const FormFactorLinks& links,
                                 const std::vector<Float3>& in) {
  return gather(LinkedFormFactors(links, pairs.patches.area, pairs.patches.centroid), in);
}

/// Of F times light that changes from patch to patch, area-weighted L2.
double error_of(const Pairs& pairs, const FormFactorLinks& links) {
  const std::vector<Float3> light = test::random_light(pairs.patches.size(), 7);
  return relative_difference(gather_links(pairs, links, light), gather_pairs(pairs, light),
                             pairs.patches.area);
}

TEST(LinkFitting, WithoutAnErrorEveryPairIsALink) {
  const Pairs& pairs = furnished();
  const FormFactorLinks links = fit_links(pairs.exchange, pairs.patches, 0);
  EXPECT_EQ(links.pair.size(), pairs.exchange.column.size());
  EXPECT_LE(error_of(pairs, links), 1e-5);
  check_links(links, pairs.patches.size());
}

TEST(LinkFitting, MoreErrorTakesFewerLinks) {
  const Pairs& pairs = furnished();
  std::size_t before = pairs.exchange.column.size();
  for (const double epsilon : {1e-5, 1e-4, 1e-3}) {
    const FormFactorLinks links = fit_links(pairs.exchange, pairs.patches, epsilon);
    const double error = error_of(pairs, links);
    std::printf("error of a link %.0e: %zu links of %zu pairs, error %.4f\n", epsilon,
                links.pair.size(), pairs.exchange.column.size(), error);
    EXPECT_LT(links.pair.size(), before);
    EXPECT_LE(error, 40 * epsilon);
    before = links.pair.size();
  }
}

TEST(LinkFitting, KeepsRowSums) {
  const Pairs& pairs = furnished();
  const std::vector<Float3> ones(pairs.patches.size(), {1, 1, 1});
  const FormFactorLinks links = fit_links(pairs.exchange, pairs.patches, 1e-3);
  const auto truth = gather_pairs(pairs, ones), found = gather_links(pairs, links, ones);
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(found[i][0], truth[i][0], 1e-3);
}

TEST(LinkFitting, NoLightThroughAWall) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {3, 3, 4}, true);
  test::add_box(scene, {3.05, 0, 0}, {6, 3, 4}, true);
  const Pairs pairs = pairs_of(scene, 500);
  const FormFactorLinks links = fit_links(pairs.exchange, pairs.patches, 3e-3);
  EXPECT_LT(links.pair.size(), pairs.exchange.column.size() / 4);
  const auto in_first = [&](std::size_t i) { return pairs.patches.centroid[i][0] < 3.02F; };
  std::vector<Float3> light(pairs.patches.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (in_first(i)) light[i] = {1, 1, 1};
  }
  const auto found = gather_links(pairs, links, light);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (in_first(i)) continue;
    EXPECT_EQ(found[i][0], 0) << i;
  }
}

TEST(LinkFitting, SameBitsForAnyNumberOfThreads) {
  const Pairs& pairs = furnished();
  const auto make = [&] { return fit_links(pairs.exchange, pairs.patches, 1e-4); };
  const FormFactorLinks one = test::with_threads(1, make), five = test::with_threads(5, make);
  EXPECT_EQ(one.pair, five.pair);
  EXPECT_EQ(one.exchange_area, five.exchange_area);
  EXPECT_EQ(one.gradient, five.gradient);
  EXPECT_EQ(one.scale, five.scale);
}

TEST(LinkFitting, RefusesWhatDoesNotFit) {
  const Pairs& pairs = furnished();
  for (const double epsilon : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    test::expect_error([&] { fit_links(pairs.exchange, pairs.patches, epsilon); }, "not negative");
  }
  test::expect_error([&] { fit_links({}, pairs.patches, 1e-4); }, "differ in number");
}

}  // namespace
}  // namespace rebounce
