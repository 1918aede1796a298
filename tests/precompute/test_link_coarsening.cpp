#include "rebounce/precompute/link_coarsening.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "expect_error.h"
#include "rebounce/precompute/links.h"
#include "test_scenes.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kSide = 16;  // patches of each of two walls

struct Walls {
  FormFactorLinks links;
  std::vector<float> area;
  std::vector<Float3> centroid;
};

/// Two rows of patches that face each other, each pair linked with the exchange area `exchange` of
/// the places along them, times the patches' areas.
Walls two_walls(const std::function<double(double, double)>& exchange) {
  Walls walls;
  constexpr std::uint32_t kPatches = 2 * kSide, kNodes = 2 * kPatches - 1;
  for (std::uint32_t i = 0; i < kPatches; ++i) {
    const auto along = static_cast<float>(i % kSide);
    walls.area.push_back(0.5F + 0.05F * along);
    walls.centroid.push_back({along, i < kSide ? 0.0F : 4.0F, 0.1F * along});
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
      const double kernel = exchange(walls.centroid[i][0], walls.centroid[j][0]);
      walls.links.pair.push_back({kPatches - 1 + i, kPatches - 1 + j});
      walls.links.exchange_area.push_back(
          static_cast<float>(kernel * walls.area[i] * walls.area[j]));
      walls.links.gradient.push_back({});
    }
  }
  return walls;
}

std::vector<Float3> gathered(const Walls& walls, const FormFactorLinks& links,
                             const std::vector<Float3>& light) {
  return gather(LinkedFormFactors(links, walls.area, walls.centroid), light);
}

/// Of the symmetric form, Frobenius.
double difference(const Walls& walls, const FormFactorLinks& coarse) {
  double sum = 0;
  for (std::size_t j = 0; j < walls.area.size(); ++j) {
    std::vector<Float3> unit(walls.area.size());
    unit[j][0] = 1;
    const auto a = gathered(walls, walls.links, unit), b = gathered(walls, coarse, unit);
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += std::pow(a[i][0] - b[i][0], 2) * walls.area[i] / walls.area[j];
    }
  }
  return std::sqrt(sum);
}

double near_kernel(double x, double y) {
  return 0.02 / (0.2 + 0.05 * (x - y) * (x - y));
}

TEST(LinkCoarsening, AnAffineKernelIsOneLink) {
  const Walls walls = two_walls([](double x, double y) { return 1e-3 * (5 + 0.2 * x - 0.1 * y); });
  const FormFactorLinks coarse = coarsen_links(walls.links, walls.area, walls.centroid, 1e-4);
  ASSERT_EQ(coarse.pair.size(), 1U);
  EXPECT_EQ(coarse.count[coarse.pair[0][0]], kSide);
  EXPECT_EQ(coarse.count[coarse.pair[0][1]], kSide);
  EXPECT_LE(difference(walls, coarse), 1e-3);  // of 0.08: gradients have eight bits
}

TEST(LinkCoarsening, LosesNoMoreThanItIsAllowed) {
  const Walls walls = two_walls(near_kernel);
  std::size_t before = walls.links.pair.size();
  for (const double epsilon : {1e-3, 3e-3, 1e-2}) {
    const FormFactorLinks coarse = coarsen_links(walls.links, walls.area, walls.centroid, epsilon);
    const auto count = static_cast<double>(coarse.pair.size());
    EXPECT_LT(coarse.pair.size(), before);
    before = coarse.pair.size();
    EXPECT_GT(coarse.pair.size(), 1U);
    // Both triangles; scaling moves it a little.
    EXPECT_LE(difference(walls, coarse), 1.5 * epsilon * std::sqrt(2 * count));
  }
}

TEST(LinkCoarsening, KeepsRowSums) {
  const Walls walls = two_walls(near_kernel);
  const FormFactorLinks coarse = coarsen_links(walls.links, walls.area, walls.centroid, 1e-2);
  const std::vector<Float3> ones(walls.area.size(), {1, 1, 1});
  const auto a = gathered(walls, walls.links, ones), b = gathered(walls, coarse, ones);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(b[i][0] / a[i][0], 1, 1e-3);
}

/// Two closed rooms with a wall of 10 cm between them, and links of the pairs in each.
struct TwoRooms {
  PatchModel model = make_patch_model(scene(), {.patch_count = 600});
  FormFactorLinks links =
      build_links(model, test::make_tracer(model), {.link_epsilon = kLinkEpsilon}).links;

  static Scene scene() {
    Scene scene = test::empty_scene();
    test::add_box(scene, {0, 0, 0}, {3, 3, 3}, true);
    test::add_box(scene, {3.1, 0, 0}, {6.1, 3, 3}, true);
    return scene;
  }

  bool is_in_first_room(std::size_t patch) const {
    return model.patches.centroid[patch][0] < 3.05F;
  }

  FormFactorLinks coarser(double epsilon) const {
    return coarsen_links(links, model.patches.area, model.patches.centroid, epsilon);
  }

  std::vector<Float3> gathered(const FormFactorLinks& by, const std::vector<Float3>& light) const {
    return gather(LinkedFormFactors(by, model.patches.area, model.patches.centroid), light);
  }
};

TEST(LinkCoarsening, CarriesNothingThroughAWall) {
  const TwoRooms rooms;
  std::vector<Float3> light(rooms.model.patches.size(), {0, 0, 0});
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (rooms.is_in_first_room(i)) light[i] = {1, 1, 1};
  }
  for (const double part : {kLinkCoarsening, 1.0, 20.0}) {
    const FormFactorLinks coarse = rooms.coarser(part * kLinkEpsilon);
    ASSERT_LT(coarse.pair.size(), rooms.links.pair.size());
    const std::vector<Float3> arrived = rooms.gathered(coarse, light);
    for (std::size_t i = 0; i < light.size(); ++i) {
      if (rooms.is_in_first_room(i)) continue;
      EXPECT_EQ(arrived[i], (Float3{0, 0, 0})) << i;
    }
  }
}

TEST(LinkCoarsening, KeepsRowSumsOfRooms) {
  const TwoRooms rooms;
  const std::vector<Float3> ones(rooms.model.patches.size(), {1, 1, 1});
  const std::vector<Float3> before = rooms.gathered(rooms.links, ones);
  for (const double part : {kLinkCoarsening, 1.0}) {
    const std::vector<Float3> after = rooms.gathered(rooms.coarser(part * kLinkEpsilon), ones);
    for (std::size_t i = 0; i < ones.size(); ++i) {
      EXPECT_NEAR(after[i][0], before[i][0], 1e-3) << i;
    }
  }
}

TEST(LinkCoarsening, WithoutAnErrorNothingIsMerged) {
  const Walls walls = two_walls(near_kernel);
  const FormFactorLinks same = coarsen_links(walls.links, walls.area, walls.centroid, 0);
  EXPECT_EQ(same.pair, walls.links.pair);
  EXPECT_EQ(same.exchange_area, walls.links.exchange_area);
}

TEST(LinkCoarsening, RefusesWhatIsNoError) {
  const Walls walls = two_walls(near_kernel);
  for (const double epsilon : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    test::expect_error([&] { coarsen_links(walls.links, walls.area, walls.centroid, epsilon); },
                       "not negative");
  }
}

}  // namespace
}  // namespace rebounce
