// Links fitted to the pairs that other links stand for: fewer, and the same light.

#include "precompute/exchange/links/link_fitting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "precompute/exchange/links/links.h"
#include "tests/precompute/exchange/links/linked_patches.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_link_refitting {
namespace {

constexpr std::uint32_t kSide = 16;  // patches of each of two walls

struct Walls {
  FormFactorLinks links;
  PatchTable patches;
};

/// Two rows of patches that face each other, each pair linked with the exchange area `exchange` of
/// the places along them, times the patches' areas.
Walls two_walls(const std::function<double(double, double)>& exchange) {
  Walls walls;
  constexpr std::uint32_t kPatches = 2 * kSide, kNodes = 2 * kPatches - 1;
  for (std::uint32_t i = 0; i < kPatches; ++i) {
    const auto along = static_cast<float>(i % kSide);
    walls.patches.area.push_back(0.5F + 0.05F * along);
    walls.patches.centroid.push_back({along, i < kSide ? 0.0F : 4.0F, 0.1F * along});
    walls.links.patch.push_back(i);
    walls.links.scale.push_back(1);
  }
  for (std::uint32_t k = 0; k < kNodes; ++k) {
    const bool is_leaf = k >= kPatches - 1;
    walls.links.first_child.push_back(is_leaf ? kNone : 2 * k + 1);
    walls.links.count.push_back(is_leaf ? 1 : 0);
  }
  for (std::uint32_t k = kPatches - 1; k-- > 0;) {
    walls.links.count[k] = walls.links.count[2 * k + 1] + walls.links.count[2 * k + 2];
  }
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = kSide; j < kPatches; ++j) {
      const double kernel = exchange(walls.patches.centroid[i][0], walls.patches.centroid[j][0]);
      walls.links.pair.push_back({kPatches - 1 + i, kPatches - 1 + j});
      walls.links.exchange_area.push_back(
          static_cast<float>(kernel * walls.patches.area[i] * walls.patches.area[j]));
      walls.links.gradient.push_back({});
    }
  }
  return walls;
}

std::vector<Float3> gathered(const Walls& walls, const FormFactorLinks& links,
                             const std::vector<Float3>& light) {
  return gather(*test::gathering(links, walls.patches), light);
}

/// Of the symmetric form, Frobenius.
double difference(const Walls& walls, const FormFactorLinks& coarse) {
  double sum = 0;
  for (std::size_t j = 0; j < walls.patches.size(); ++j) {
    std::vector<Float3> unit(walls.patches.size());
    unit[j][0] = 1;
    const auto a = gathered(walls, walls.links, unit), b = gathered(walls, coarse, unit);
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += std::pow(a[i][0] - b[i][0], 2) * walls.patches.area[i] / walls.patches.area[j];
    }
  }
  return std::sqrt(sum);
}

/// Of all that the walls exchange, likewise.
double norm(const Walls& walls) {
  FormFactorLinks none = walls.links;
  std::ranges::fill(none.exchange_area, 0.0F);
  return difference(walls, none);
}

double near_kernel(double x, double y) {
  return 0.02 / (0.2 + 0.05 * (x - y) * (x - y));
}

TEST(LinkRefitting, AnAffineKernelIsOneLink) {
  const Walls walls = two_walls([](double x, double y) { return 1e-3 * (5 + 0.2 * x - 0.1 * y); });
  const FormFactorLinks fewer = test::fewer_links(walls.links, walls.patches, 0.1);
  ASSERT_EQ(fewer.pair.size(), 1U);
  EXPECT_EQ(fewer.count[fewer.pair[0][0]], kSide);
  EXPECT_EQ(fewer.count[fewer.pair[0][1]], kSide);
  EXPECT_LE(difference(walls, fewer), 1e-3);  // of 0.08: gradients have eight bits
}

TEST(LinkRefitting, WorthMoreLinksAreFewerAndLessTrue) {
  const Walls walls = two_walls(near_kernel);
  std::size_t count = walls.links.pair.size();
  double error = 1e-3;  // that of bits that gradients have not
  for (const double error_per_link : {0.02, 0.1, 0.3}) {
    const FormFactorLinks fewer = test::fewer_links(walls.links, walls.patches, error_per_link);
    EXPECT_LT(fewer.pair.size(), count);
    EXPECT_GT(fewer.pair.size(), 1U);
    EXPECT_GT(difference(walls, fewer), error);
    // Another link would have cost more than all the error.
    EXPECT_LE(difference(walls, fewer), error_per_link * norm(walls) * std::sqrt(count / 32.0));
    count = fewer.pair.size();
    error = difference(walls, fewer);
  }
}

TEST(LinkRefitting, WorthNextToNothingTheLightIsTheSame) {
  const Walls walls = two_walls(near_kernel);
  EXPECT_LE(difference(walls, test::fewer_links(walls.links, walls.patches, 1e-9)),
            5e-4 * norm(walls));
}

TEST(LinkRefitting, KeepsWhatPatchesExchangeWithThemselves) {
  Walls walls = two_walls(near_kernel);
  const std::uint32_t leaf = 2 * kSide - 1 + 3;  // of the fourth patch
  walls.links.pair.push_back({leaf, leaf});
  walls.links.exchange_area.push_back(0.1F * walls.patches.area[3]);
  walls.links.gradient.push_back({});
  std::vector<Float3> light(walls.patches.size());
  light[3] = {1, 1, 1};
  const FormFactorLinks fewer = test::fewer_links(walls.links, walls.patches, 0.02);
  EXPECT_NEAR(gathered(walls, fewer, light)[3][0], 0.1, 1e-3);
}

/// Two closed rooms with a wall of 10 cm between them, and links of the pairs in each.
struct TwoRooms {
  PatchModel model = make_patch_model(scene(), {.patch_count = 600});
  FormFactorLinks links = flat_links(
      *LinkBuilder(model, test::make_tracer(model), {}).build(kLinkEpsilon).form_factors);

  static Scene scene() {
    Scene scene = test::empty_scene();
    test::add_box(scene, {0, 0, 0}, {3, 3, 3}, true);
    test::add_box(scene, {3.1, 0, 0}, {6.1, 3, 3}, true);
    return scene;
  }

  bool is_in_first_room(std::size_t patch) const {
    return model.patches.centroid[patch][0] < 3.05F;
  }

  FormFactorLinks fewer(double error_per_link) const {
    return test::fewer_links(links, model.patches, error_per_link);
  }

  std::vector<Float3> gathered(const FormFactorLinks& by, const std::vector<Float3>& light) const {
    return gather(*test::gathering(by, model.patches), light);
  }
};

TEST(LinkRefitting, CarriesNothingThroughAWall) {
  const TwoRooms rooms;
  std::vector<Float3> light(rooms.model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (rooms.is_in_first_room(i)) light[i] = {1, 1, 1};
  }
  for (const double error_per_link : {kErrorPerLink, 1e-2, 0.2}) {
    const FormFactorLinks coarse = rooms.fewer(error_per_link);
    ASSERT_LT(coarse.pair.size(), rooms.links.pair.size());
    const std::vector<Float3> arrived = rooms.gathered(coarse, light);
    for (std::size_t i = 0; i < light.size(); ++i) {
      if (rooms.is_in_first_room(i)) continue;
      EXPECT_EQ(arrived[i], (Float3{0, 0, 0})) << i;
    }
  }
}

TEST(LinkRefitting, KeepsRowSumsOfRooms) {
  const TwoRooms rooms;
  const std::vector<Float3> ones(rooms.model.patches.size(), {1, 1, 1});
  const std::vector<Float3> before = rooms.gathered(rooms.links, ones);
  for (const double error_per_link : {kErrorPerLink, 3e-3}) {
    const std::vector<Float3> after = rooms.gathered(rooms.fewer(error_per_link), ones);
    for (std::size_t i = 0; i < ones.size(); ++i) {
      EXPECT_NEAR(after[i][0], before[i][0], 1e-3) << i;
    }
  }
}

TEST(LinkRefitting, RefusesWhatDoesNotFit) {
  Walls walls = two_walls(near_kernel);
  test::expect_error([&] { test::fewer_links(walls.links, walls.patches, 0); }, "above 0");
  const auto gathering = test::gathering(walls.links, walls.patches);
  walls.patches.area.pop_back();
  walls.patches.centroid.pop_back();
  test::expect_error([&] { test::fewer_links(walls.links, walls.patches); }, "patch");
  test::expect_error([&] { fit_links(gathering, walls.patches); }, "patch");
}

}  // namespace
}  // namespace rebounce::test_link_refitting
