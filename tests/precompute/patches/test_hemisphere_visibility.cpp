// What sees little of the scene gets few patches.

#include "precompute/patches/hemisphere_visibility.h"

#include <gtest/gtest.h>

#include "precompute/patches/patch_model.h"
#include "precompute/patches/subdivision.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_hemisphere_visibility {
namespace {

/// A room of 5 x 3 x 4 m in a shell that is 0.5 m larger on every side: what is outside sees
/// nothing.
Scene room_in_shell() {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, true);
  scene.materials.push_back(scene.materials[0]);
  test::add_box(scene, {-0.5, -0.5, -0.5}, {5.5, 3.5, 4.5}, false, 1);
  return scene;
}

TEST(HemisphereVisibility, OfTheInsideIsAllAndOfTheOutsideNothing) {
  const Scene scene = room_in_shell();
  const RayTracer tracer(scene.position, scene.triangle);
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    EXPECT_EQ(hemisphere_visibility(corners_of(scene, t), tracer, 64, t),
              scene.triangle_material[t] == 0 ? 1 : 0);
  }
  EXPECT_EQ(density_weight(1), 1);
  EXPECT_EQ(density_weight(0.25), 1);
  EXPECT_DOUBLE_EQ(density_weight(0.125), 0.5);
  EXPECT_GT(density_weight(0), 0);
}

TEST(HemisphereVisibility, WhatSeesNothingGetsFewPatches) {
  const PatchModel model = make_patch_model(room_in_shell(), {.patch_count = 1000});
  EXPECT_NEAR(static_cast<double>(model.patches.size()), 1000, 100);
  std::vector<std::uint8_t> outside(model.patches.size());
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const std::uint32_t patch = model.mesh.triangle_patch[t];
    ASSERT_NE(patch, kNone);
    outside[patch] = model.mesh.triangle_material[t] == 1 ? 1 : 0;
  }
  double area_outside = 0;
  std::size_t count_outside = 0;
  for (std::size_t i = 0; i < outside.size(); ++i) {
    area_outside += outside[i] * model.patches.area[i];
    count_outside += outside[i];
  }
  EXPECT_NEAR(area_outside, 2 * (6 * 4 + 6 * 5 + 4 * 5), 1e-3);
  EXPECT_LT(count_outside, model.patches.size() / 10);
  EXPECT_GT(count_outside, 0U);
}

TEST(HemisphereVisibility, ImportantTrianglesAreSplitMore) {
  Scene scene = test::empty_scene();
  for (const double x : {0.0, 1.0}) {  // they share an edge
    const std::vector<glm::dvec3> square = {{x, 0, 0}, {x, 0, 1}, {x + 1, 0, 1}, {x + 1, 0, 0}};
    test::add_polygon(scene, square);
  }
  const std::vector<float> density_weight = {1, 1, 1.0F / 16, 1.0F / 16};
  const std::vector<std::uint32_t> source =
      subdivide(scene, std::vector<std::uint8_t>(4, 1), {.patch_count = 1000}, density_weight);
  double area = 0;
  std::size_t important = 0;
  for (std::uint32_t t = 0; t < source.size(); ++t) {
    const double a = area_of(corners_of(scene, t));
    area += a;
    important += source[t] < 2 ? 1 : 0;
    const TriangleCorners p = corners_of(scene, t);
    const double longest =
        std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
    EXPECT_GT(a, 0.2 * longest * longest) << "half of a square at most";
  }
  EXPECT_NEAR(area, 2, 1e-5);
  EXPECT_GE(source.size(), 1000U);
  EXPECT_GT(important, 8 * (source.size() - important));
}

}  // namespace
}  // namespace rebounce::test_hemisphere_visibility
