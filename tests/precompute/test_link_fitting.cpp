// Links made from the form factors of all pairs: as true as asked, and no light through walls.

#include "rebounce/precompute/link_fitting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "expect_error.h"
#include "random_light.h"
#include "rebounce/precompute/form_factors.h"
#include "rebounce/precompute/links.h"
#include "rebounce/transfer/area_norm.h"
#include "rebounce/transfer/exchange_matrix.h"
#include "rebounce/transfer/linked_form_factors.h"
#include "test_scenes.h"
#include "with_threads.h"

namespace rebounce {
namespace {

struct Pairs {
  PatchTable patches;
  ExchangeMatrix exchange;
  FormFactorLinks links;  ///< by rays of their own
};

Pairs pairs_of(const Scene& scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(scene, {.patch_count = patch_count});
  const RayTracer tracer = test::make_tracer(model);
  ExchangeMatrix exchange = compute_form_factors(model, tracer).exchange;
  FormFactorLinks links = build_links(model, tracer, {.link_epsilon = kLinkEpsilon}).links;
  return {std::move(model.patches), std::move(exchange), std::move(links)};
}

FormFactorLinks fitted(const Pairs& pairs) {
  return fit_links(pairs.links, pairs.exchange, pairs.patches);
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

/// A tree of which every pair of patches is a link, all with the same wrong exchange area.
FormFactorLinks all_pairs(const Pairs& pairs) {
  FormFactorLinks links = pairs.links;
  links.pair.clear();
  std::vector<std::uint32_t> leaf(pairs.patches.size());
  const std::vector<std::uint32_t> first = first_positions(links);
  for (std::uint32_t k = 0; k < first.size(); ++k) {
    if (links.first_child[k] == kNone) leaf[links.patch[first[k]]] = k;
  }
  for (std::uint32_t i = 0; i < leaf.size(); ++i) {
    for (std::uint32_t j = 0; j < i; ++j) links.pair.push_back({leaf[i], leaf[j]});
  }
  links.exchange_area.assign(links.pair.size(), 1);
  links.gradient.assign(links.pair.size(), {});
  return links;
}

TEST(LinkFitting, LinksOfSinglePatchesAreTheirPairs) {
  const Pairs& pairs = furnished();
  const FormFactorLinks links = fit_links(all_pairs(pairs), pairs.exchange, pairs.patches);
  EXPECT_EQ(links.pair.size(), pairs.exchange.column.size());  // others have no light
  EXPECT_LE(error_of(pairs, links), 1e-5);
  check_links(links, pairs.patches.size());
}

TEST(LinkFitting, IsNearerToThePairsThanRaysOfLinksAre) {
  const Pairs& pairs = furnished();
  const double traced = error_of(pairs, pairs.links), found = error_of(pairs, fitted(pairs));
  std::printf("error of F times light: %.4f by rays of the links, %.4f fitted\n", traced, found);
  EXPECT_LT(found, traced);
  EXPECT_LE(found, 0.002);
}

TEST(LinkFitting, KeepsRowSums) {
  const Pairs& pairs = furnished();
  const std::vector<Float3> ones(pairs.patches.size(), {1, 1, 1});
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
  const auto make = [&] { return fitted(pairs); };
  const FormFactorLinks one = test::with_threads(1, make), five = test::with_threads(5, make);
  EXPECT_EQ(one.pair, five.pair);
  EXPECT_EQ(one.exchange_area, five.exchange_area);
  EXPECT_EQ(one.gradient, five.gradient);
  EXPECT_EQ(one.scale, five.scale);
}

TEST(LinkFitting, RefusesWhatDoesNotFit) {
  const Pairs& pairs = furnished();
  test::expect_error([&] { fit_links(pairs.links, {}, pairs.patches); }, "differ in number");
  FormFactorLinks damaged = pairs.links;
  damaged.pair[0][0] = static_cast<std::uint32_t>(damaged.first_child.size());
  test::expect_error([&] { fit_links(damaged, pairs.exchange, pairs.patches); }, "links");
}

}  // namespace
}  // namespace rebounce
