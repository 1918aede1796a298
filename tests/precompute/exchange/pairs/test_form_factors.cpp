// Form factors of whole scenes: closure, reciprocity, occlusion, escape.

#include "precompute/exchange/pairs/form_factors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "rebounce/error.h"
#include "tests/support/form_factor_sums.h"
#include "tests/support/view_factor_table.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_form_factors {
namespace {

FormFactors form_factors_of(const PatchModel& model, const FormFactorSettings& settings = {}) {
  return compute_form_factors(model, test::make_tracer(model), settings);
}

TEST(FormFactors, AgreeWithEveryRowOfTheTable) {
  const auto cases =
      test::read_view_factors(REBOUNCE_SOURCE_DIR "/tests/reference/view_factors.tsv");
  for (const test::ViewFactorCase& c : cases) {
    if (c.a.size() > 4 || c.id.starts_with("INF")) continue;  // the kernel's test has them
    PatchModel model = make_patch_model(test::scene_of_two(c.a, c.b), {.patch_count = 200});
    const double factor = test::factor_between(model, form_factors_of(model), 0, 1);
    EXPECT_NEAR(factor, c.factor, std::max(5e-3 * c.factor, 5e-5)) << c.id;
  }
}

TEST(FormFactors, EmptyRoomIsClosedBeforeAnyCorrection) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {-1, 0, 2}, {3, 2.5, 8}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 600});
  const FormFactors f = form_factors_of(model);
  EXPECT_LT(f.closure.row_sum_error_before, 1e-3);
  for (const double sum : test::row_sums_of(model, f)) EXPECT_NEAR(sum, 1, 1e-6);
  for (const float sky : f.sky_visibility) EXPECT_NEAR(sky, 0, 1e-6);
}

TEST(FormFactors, RowsBesideHoveringBlocksAddUpBeforeAnyCorrection) {
  // What pokes in between the corners of two patches, and penumbrae in the slot under a block.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1, 0.3, 1}, {2, 1.2, 2.5}, false);
  test::add_box(scene, {2.5, 1.5, 3}, {3, 2, 4}, false);
  const FormFactors f = form_factors_of(make_patch_model(scene, {.patch_count = 1000}));
  EXPECT_LT(f.closure.row_sum_error_before, 1e-3);
}

TEST(FormFactors, FurnishedRoomIsClosed) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 1200});
  const FormFactors f = form_factors_of(model);
  const std::vector<double> sum = test::row_sums_of(model, f);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    EXPECT_NEAR(sum[i] + f.sky_visibility[i] + f.absorbed[i], 1, 1e-3);
    EXPECT_EQ(f.sky_visibility[i], 0);  // the room has no opening
    if (f.absorbed[i] == 0) {
      EXPECT_NEAR(sum[i], 1, 1e-3);
    }
  }
  EXPECT_LT(f.closure.relative_change, 0.02);
}

TEST(FormFactors, EntriesAreSaneAndInOrder) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 800});
  const FormFactors f = form_factors_of(model);
  ASSERT_EQ(f.exchange.patch_count(), model.patches.size());
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    for (std::uint64_t k = f.exchange.row_begin[i]; k < f.exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t j = f.exchange.column[k];
      ASSERT_GT(j, i);
      if (k > f.exchange.row_begin[i]) {
        ASSERT_GT(j, f.exchange.column[k - 1]);
      }
      ASSERT_GT(f.exchange.exchange_area[k], 0);
      ASSERT_LE(f.exchange.exchange_area[k],
                std::min(model.patches.area[i], model.patches.area[j]));
    }
  }
}

TEST(FormFactors, OpeningsAndBackFacesAreAccountedFor) {
  // A box without its top: what the floor loses to the sky is the factor between opposite squares.
  Scene scene = test::empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  test::remove_face(scene, test::Face::kHighY);
  scene.triangle_material[4] = scene.triangle_material[5] = 1;  // -y
  const PatchModel model = make_patch_model(scene, {.patch_count = 500});
  const FormFactors f = form_factors_of(model);
  double floor_sky = 0, floor_area = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    EXPECT_EQ(f.absorbed[i], 0);
    if (test::material_of(model, i) != 1) continue;
    floor_sky += model.patches.area[i] * f.sky_visibility[i];
    floor_area += model.patches.area[i];
  }
  EXPECT_NEAR(floor_area, 1, 1e-6);
  EXPECT_NEAR(floor_sky, 0.19982489569839, 1e-3);

  // The same opening closed by a lid that shows its back: as much is absorbed.
  Scene lidded = scene;
  const std::vector<glm::dvec3> lid = {{0, 1, 0}, {0, 1, 1}, {1, 1, 1}, {1, 1, 0}};
  test::add_polygon(lidded, lid, 0);
  const PatchModel lidded_model = make_patch_model(lidded, {.patch_count = 500});
  const FormFactors g = form_factors_of(lidded_model);
  double absorbed = 0;
  for (std::size_t i = 0; i < lidded_model.patches.size(); ++i) {
    if (test::material_of(lidded_model, i) != 1) continue;
    absorbed += lidded_model.patches.area[i] * g.absorbed[i];
  }
  EXPECT_NEAR(absorbed, 0.19982489569839, 1e-3);
}

TEST(FormFactors, CoplanarAndBackFacingPatchesExchangeNothing) {
  const PatchModel model =
      make_patch_model(test::scene_of_two({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                                          {{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}),
                       {.patch_count = 100});
  EXPECT_EQ(form_factors_of(model).exchange.column.size(), 0U);
}

TEST(FormFactors, CopiesThatLieInOneAnotherCountOnce) {
  // The room again, with every wall there twice.
  Scene once = test::empty_scene(), twice = test::empty_scene();
  test::add_box(once, {0, 0, 0}, {2, 2, 2}, true);
  test::add_box(twice, {0, 0, 0}, {2, 2, 2}, true);
  test::add_box(twice, {0, 0, 0}, {2, 2, 2}, true);
  const PatchModel model = make_patch_model(twice, {.patch_count = 300});
  const PatchModel reference = make_patch_model(once, {.patch_count = 300});
  EXPECT_EQ(model.patches.size(), reference.patches.size());
  EXPECT_EQ(model.covered_side_count, model.mesh.triangle.size() / 2);
  for (const std::uint32_t patch : model.shown_patch) EXPECT_NE(patch, kNone);
  const FormFactors f = form_factors_of(model);
  EXPECT_LT(f.closure.row_sum_error_before, 1e-3);
}

TEST(FormFactors, BothSidesOfASheetOfTwoSurfacesExchangeLight) {
  // A room cut in two by two one-sided walls back to back in one plane: each half is closed.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 2, 3}, true);
  std::vector<glm::dvec3> wall = {{1.3, 0, 0}, {1.3, 2, 0}, {1.3, 2, 3}, {1.3, 0, 3}};
  test::add_polygon(scene, wall);
  std::ranges::reverse(wall);
  test::add_polygon(scene, wall);
  const PatchModel model = make_patch_model(scene, {.patch_count = 400});
  std::size_t in_wall = 0;
  for (const Float3& c : model.patches.centroid) in_wall += std::abs(c[0] - 1.3F) < 1e-4F ? 1 : 0;
  EXPECT_GT(in_wall, 20U);
  EXPECT_EQ(model.unlit_side_count, 0U);
  const FormFactors f = form_factors_of(model);
  for (const float absorbed : f.absorbed) EXPECT_NEAR(absorbed, 0, 1e-6);
  EXPECT_LT(f.closure.row_sum_error_before, 1e-3);
  for (const double sum : test::row_sums_of(model, f)) EXPECT_NEAR(sum, 1, 1e-6);
}

TEST(FormFactors, SideThatABoxStandsOnIsSealed) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 4}, true);
  test::add_box(scene, {1, 0, 1}, {2, 1, 2}, false);
  const PatchModel model = make_patch_model(scene, {.patch_count = 300});
  EXPECT_GT(model.unlit_side_count + model.buried_side_count, 0U);
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    const Float3 &c = model.patches.centroid[i], &n = model.patches.normal[i];
    EXPECT_FALSE(c[1] < 1e-3F && n[1] < 0) << "the bottom of the box has a patch";
  }
}

TEST(FormFactors, QualityDecidesRaysAndLeavesTheRest) {
  for (const FormFactorQuality quality : {FormFactorQuality::kLow, FormFactorQuality::kHigh}) {
    const FormFactorSettings settings = with_quality(quality, {.seed = 5, .link_epsilon = 0.5});
    EXPECT_EQ(settings.seed, 5U);
    EXPECT_EQ(settings.link_epsilon, 0.5);
  }
  EXPECT_LT(with_quality(FormFactorQuality::kLow).full_rays, FormFactorSettings().full_rays);
  EXPECT_GT(with_quality(FormFactorQuality::kHigh).full_rays, FormFactorSettings().full_rays);
}

TEST(FormFactors, SameBitsForAnyNumberOfThreads) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 400});
  const auto make = [&] { return form_factors_of(model); };
  const FormFactors one = test::with_threads(1, make), three = test::with_threads(3, make);
  EXPECT_TRUE(std::ranges::equal(one.exchange.column, three.exchange.column));
  EXPECT_TRUE(std::ranges::equal(one.exchange.exchange_area, three.exchange.exchange_area));
  EXPECT_EQ(one.absorbed, three.absorbed);
}

TEST(FormFactors, AreForecastByASample) {
  for (const std::size_t patch_count : {400, 1600}) {
    const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = patch_count});
    const auto make = [&] { return forecast_form_factors(model, test::make_tracer(model)); };
    const FormFactorForecast one = test::with_threads(1, make), three = test::with_threads(3, make);
    EXPECT_EQ(one.ray_count, three.ray_count);
    EXPECT_GT(one.seconds, 0);
    EXPECT_EQ(one.entry_count, three.entry_count);
    const FormFactors found = form_factors_of(model);
    const auto rays = static_cast<double>(found.ray_count);
    EXPECT_GT(one.ray_count, 0.6 * rays);
    EXPECT_LT(one.ray_count, 1.6 * rays);
    const auto entries = static_cast<double>(found.exchange.column.size());
    EXPECT_GT(one.entry_count, 0.7 * entries);
    EXPECT_LT(one.entry_count, 1.4 * entries);
  }
}

TEST(FormFactors, AnotherSeedGivesNearlyTheSame) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 400});
  const FormFactors a = form_factors_of(model, {.seed = 1}),
                    b = form_factors_of(model, {.seed = 2});
  const auto total = [](const FormFactors& f) {
    return std::accumulate(f.exchange.exchange_area.begin(), f.exchange.exchange_area.end(), 0.0);
  };
  EXPECT_NE(total(a), total(b));
  EXPECT_NEAR(total(a) / total(b), 1, 2e-3);
}

TEST(FormFactors, StopsWhenAskedTo) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 400});
  const RayTracer tracer = test::make_tracer(model);
  EXPECT_THROW(compute_form_factors(model, tracer, {}, [](double) { return false; }), Cancelled);
}

TEST(FormFactors, RefuseSettingsOutOfRange) {
  const PatchModel model = make_patch_model(test::furnished_room(), {.patch_count = 50});
  const RayTracer tracer = test::make_tracer(model);
  EXPECT_THROW(compute_form_factors(model, tracer, {.probe_rays = 0}), Error);
  EXPECT_THROW(compute_form_factors(model, tracer, {.full_rays = 257}), Error);
  EXPECT_THROW(compute_form_factors(model, tracer, {.hemisphere_rays = 0}), Error);
}

}  // namespace
}  // namespace rebounce::test_form_factors
