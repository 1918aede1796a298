#include "precompute/patches/patch_model.h"

#include <gtest/gtest.h>

#include <numeric>

#include "precompute/patches/lit_sides.h"
#include "rebounce/error.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_patch_model {
namespace {

Scene double_sided(Scene scene) {
  for (Material& material : scene.materials) material.double_sided = true;
  return scene;
}

TEST(PatchModel, ConservesAreaAndReflectance) {
  Scene scene = test::empty_scene({0.2F, 0.4F, 0.6F});
  scene.materials.resize(2, scene.materials[0]);
  scene.materials[1].base_color = {0.5F, 0.5F, 0.1F};
  scene.materials[1].emitted_luminance = {1, 2, 3};
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true, 0);
  test::add_box(scene, {1, 1, 1}, {2, 2, 2}, false, 1);
  const PatchModel model = make_patch_model(scene, {.patch_count = 1000});
  double area = 0, red = 0, emitted = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    area += model.patches.area[i];
    red += model.patches.area[i] * model.patches.reflectance[i][0];
    emitted += model.patches.area[i] * model.patches.emitted_exitance[i][2];
  }
  EXPECT_NEAR(area, 94 + 6, 1e-3);
  EXPECT_NEAR(red, 94 * 0.2 + 6 * 0.5, 1e-3);
  EXPECT_NEAR(emitted, 6 * 3 * std::numbers::pi, 1e-3);
}

TEST(PatchModel, ClampsReflectanceWithAWarning) {
  Scene scene = test::empty_scene({1, 1, 0.5F});
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  const PatchModel model = make_patch_model(scene, {.patch_count = 50});
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_NE(model.warnings[0].find("0.99"), std::string::npos);
  for (const Float3& rho : model.patches.reflectance) EXPECT_EQ(rho[0], kMaxReflectance);
}

TEST(PatchModel, RoomOfDoubleSidedWallsHasPatchesInside) {
  // Outside of the walls nothing is seen; of a partition inside both sides are.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  const std::vector<glm::dvec3> partition = {{1, 0, 2}, {3, 0, 2}, {3, 2, 2}, {1, 2, 2}};
  test::add_polygon(scene, partition);
  const PatchModel model = make_patch_model(double_sided(scene), {.patch_count = 400});
  double area = 0;
  for (const float a : model.patches.area) area += a;
  EXPECT_NEAR(area, 94 + 2 * 4, 1e-3);
  EXPECT_GT(model.unlit_side_count, 0U);
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    const glm::dvec3 inwards = glm::dvec3(2, 1.5, 2.5) - to_dvec3(model.patches.centroid[i]);
    const bool on_partition = std::abs(model.patches.centroid[i][2] - 2) < 1e-5 &&
                              std::abs(model.patches.normal[i][2]) > 0.9;
    if (!on_partition) {
      EXPECT_GT(glm::dot(inwards, to_dvec3(model.patches.normal[i])), 0);
    }
  }
}

TEST(PatchModel, BottomOfABoxOnTheFloorHasNoPatch) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1, 0, 1}, {2, 1, 2}, false);
  const PatchModel model = make_patch_model(scene, {.patch_count = 300});
  double down = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    if (model.patches.normal[i][1] < -0.9F) down += model.patches.area[i];
  }
  EXPECT_NEAR(down, 20, 1e-4) << "the ceiling only";
}

TEST(PatchModel, SidesInsideOfSomethingSolidHaveNoPatch) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {8, 6, 10}, true);
  test::add_box(scene, {1, 0.2, 1}, {1.4, 0.6, 1.4}, false);
  test::add_box(scene, {1.1, 0.3, 1.1}, {1.2, 0.4, 1.2}, false);  // inside the other
  const PatchModel model = make_patch_model(scene, {.patch_count = 400});
  double area = 0;
  for (const float a : model.patches.area) area += a;
  EXPECT_NEAR(area, 2 * (48 + 60 + 80) + 6 * 0.16, 1e-3);
  EXPECT_GE(model.buried_side_count, 12U);
  // Double-sided, the box has an inside, which is as hidden.
  const PatchModel both = make_patch_model(double_sided(scene), {.patch_count = 400});
  area = 0;
  for (const float a : both.patches.area) area += a;
  EXPECT_NEAR(area, 2 * (48 + 60 + 80) + 6 * 0.16, 1e-3);
}

TEST(PatchModel, ARoomSeenFromItsBacksIsNotSolid) {
  // A lamp may hang in there.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, false);
  test::add_box(scene, {1, 1, 1}, {2, 2, 2}, false);
  EXPECT_EQ(make_patch_model(scene, {.patch_count = 100}).buried_side_count, 0U);
}

TEST(PatchModel, ACellarUnderTheSkyIsNotBuried) {
  // Of the box all but the top is below a one-sided ground, whose back it sees, and the sky.
  Scene scene = test::empty_scene();
  const std::vector<glm::dvec3> ground = {{-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}};
  test::add_polygon(scene, ground);
  test::add_box(scene, {-0.05, -0.1, -0.05}, {0.05, 0.05, 0.05}, false);
  EXPECT_EQ(make_patch_model(scene, {.patch_count = 100}).buried_side_count, 0U);
}

TEST(PatchModel, DropsSliversBelowThePrecisionOfRays) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  const std::vector<glm::dvec3> sliver = {{1, 1, 1}, {2, 1, 1}, {1.5, 1 + 1e-6, 1}};
  test::add_polygon(scene, sliver);
  EXPECT_EQ(make_patch_model(scene, {.patch_count = 100}).sliver_count, 1U);
  Scene nothing = test::empty_scene();
  test::add_polygon(nothing, sliver);
  EXPECT_THROW(make_patch_model(nothing, {}), Error);
}

TEST(PatchModel, OfNothingButOpeningsIsRefused) {
  Scene glass = test::empty_scene();
  test::add_box(glass, {0, 0, 0}, {1, 1, 1}, true);
  Scene air = glass;
  glass.materials[0].transmission = 1;
  air.materials[0].alpha_mode = AlphaMode::kBlend;
  air.materials[0].base_alpha = 0;
  for (const Scene& scene : {glass, air}) {
    test::expect_error([&] { make_patch_model(scene, {.patch_count = 100}); },
                       "no surface that light can reach");
  }
}

}  // namespace
}  // namespace rebounce::test_patch_model
