// What rays into the hemisphere of every patch say of the exchange of pairs.

#include "precompute/exchange/pairs/hemisphere_exchange.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "precompute/exchange/pairs/escape.h"
#include "precompute/exchange/pairs/form_factors.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_hemisphere_exchange {
namespace {

constexpr int kRays = 4096;

/// What the hemisphere rays of each patch meet.
std::vector<std::vector<MetPatch>> met_by_all(const PatchModel& model) {
  const RayTracer tracer = test::make_tracer(model);
  const PatchTriangles triangles(model.mesh.triangle_patch, model.patches.size());
  std::vector<std::vector<MetPatch>> met;
  EscapeScratch scratch;
  MetPatchCounter counter;
  for (std::uint32_t i = 0; i < model.patches.size(); ++i) {
    measure_escape(model.mesh, model.shown_patch, triangles[i], i, tracer, kRays, 1, scratch);
    met.push_back(counter.count(model.patches.size(), scratch.met));
  }
  return met;
}

HemisphereExchange exchange_of(const PatchModel& model) {
  const std::vector<double> area(model.patches.area.begin(), model.patches.area.end());
  return {met_by_all(model), area, kRays};
}

/// A room with `count` balls of many triangles, some of which touch the floor or each other.
Scene room_of_balls(int count) {
  Scene scene = test::empty_scene();
  for (int k = 0; k < count; ++k) {
    const std::size_t first = scene.position.size();
    test::add_ball(scene, 16, 12, false);
    const int row = k / 5, column = k % 5;
    const glm::dvec3 centre(0.5 + 0.62 * column, 0.301 + 0.4 * (k % 3), 0.6 + 0.7 * row);
    for (std::size_t v = first; v < scene.position.size(); ++v) {
      scene.position[v] = to_float3(0.3 * to_dvec3(scene.position[v]) + centre);
    }
  }
  test::add_box(scene, {0, 0, 0}, {3.6, 2.5, 4}, true);
  return scene;
}

TEST(HemisphereExchange, OfFacingSquaresIsTheirViewFactor) {
  Scene scene = test::empty_scene();
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  const PatchModel model = make_patch_model(scene, {.patch_count = 4});
  const HemisphereExchange exchange = exchange_of(model);
  double sum = 0, variance = 0;
  for (std::uint32_t i = 0; i < model.patches.size(); ++i) {
    for (const HemisphereExchange::Pair& pair : exchange.pairs(i)) {
      sum += pair.exchange;
      variance += exchange.variance(i, pair.patch, pair.exchange);
      EXPECT_NEAR(exchange.expected_count(i, pair.patch, pair.exchange), pair.count, 1e-9);
    }
  }
  EXPECT_NEAR(sum, 0.19982489569839, 3 * std::sqrt(variance));
  EXPECT_LT(std::sqrt(variance), 2e-3);
}

TEST(CountedExchange, WeighsBothSidesByTheirRays) {
  constexpr std::uint64_t kSeed = 20261125;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> area(0.1, 2), rays(100, 5000), part(0.01, 0.2);
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<double> areas{area(random), area(random)};
    const std::vector<double> counts{std::floor(rays(random)), std::floor(rays(random))};
    const CountedExchange counted(areas, counts);
    const double exchange = part(random) * std::min(areas[0], areas[1]);
    // As many rays as expected meet the other patch, from both sides.
    const double met = exchange / areas[0] * counts[0] + exchange / areas[1] * counts[1];
    EXPECT_NEAR(counted.expected_count(0, 1, exchange), met, 1e-9 * met);
    const auto whole = static_cast<std::uint32_t>(std::round(met));
    EXPECT_NEAR(counted.exchange(0, 1, whole), exchange * whole / met, 1e-9 * exchange);
    // More rays from one side tell more.
    const CountedExchange more(areas, {8 * counts[0], counts[1]});
    EXPECT_LT(more.variance(0, 1, exchange), counted.variance(0, 1, exchange));
  }
}

TEST(HemisphereExchange, ListsPairsInOrderAndFindsThem) {
  const PatchModel model = make_patch_model(room_of_balls(5), {.patch_count = 60});
  const HemisphereExchange exchange = exchange_of(model);
  for (std::uint32_t i = 0; i < model.patches.size(); ++i) {
    std::uint32_t next = i;
    for (const HemisphereExchange::Pair& pair : exchange.pairs(i)) {
      EXPECT_GE(pair.patch, next);
      next = pair.patch + 1;
      EXPECT_EQ(exchange.find(i, pair.patch).count, pair.count);
      EXPECT_GT(pair.count, 0U);
    }
    EXPECT_EQ(exchange.find(i, static_cast<std::uint32_t>(model.patches.size())).count, 0U);
  }
}

TEST(HemisphereExchange, OfWhatLiesUnderACopyCutOtherwiseIsTheSameFromEitherEnd) {
  // A ceiling there twice, cut along either diagonal: rays that meet the one without patches count
  // for the patch that is in that place, however the copy is cut.
  Scene scene = test::empty_scene();
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0, 0, 1}});
  const PatchModel model = make_patch_model(scene, {.patch_count = 24});
  ASSERT_GT(model.covered_side_count, 0U);
  const std::size_t n = model.patches.size();
  const auto rays = met_by_all(model);
  std::vector<double> count(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (const MetPatch& met : rays[i]) count[i * n + met.patch] = met.count;
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double there = model.patches.area[i] * count[i * n + j],
                   back = model.patches.area[j] * count[j * n + i];
      const double area = std::max(model.patches.area[i], model.patches.area[j]);
      EXPECT_NEAR(there, back, 6 * area * std::sqrt(count[i * n + j] + 1)) << i << ' ' << j;
    }
  }
}

TEST(HemisphereExchange, MakesRowsOfBentPatchesThatAlmostTouchAddUp) {
  // 1,920 triangles of ten balls in patches of some ten triangles each.
  const PatchModel model = make_patch_model(room_of_balls(10), {.patch_count = 250});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  EXPECT_LT(f.closure.row_sum_error_before, 0.03);
  EXPECT_LT(f.closure.row_sum_error_after, 1e-6);
  EXPECT_LT(f.closure.relative_change, 0.01);
}

TEST(Escape, PartsStayWithinOneWhateverRowsAddUpTo) {
  const std::vector<Escape> escape = {{.sky = 0, .absorbed = 1}, {.sky = 1}, {.sky = 0.1}};
  const EscapedLight light = share_escape(std::vector{-1e-6, -1e-6, 1 + 1e-6}, escape);
  EXPECT_EQ(light.absorbed, (std::vector<float>{1, 0, 0}));
  EXPECT_EQ(light.sky_visibility, (std::vector<float>{0, 1, 0}));
}

}  // namespace
}  // namespace rebounce::test_hemisphere_exchange
