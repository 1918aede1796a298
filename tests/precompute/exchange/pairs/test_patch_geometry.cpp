#include "precompute/exchange/pairs/patch_geometry.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/test_scenes.h"

namespace rebounce::test_patch_geometry {
namespace {

/// Makes every display triangle's patch the number of its material.
PatchModel model_by_material(Scene scene, std::size_t element_count) {
  PatchModel model = make_patch_model(std::move(scene), {.patch_count = element_count});
  for (std::size_t t = 0; t < model.mesh.triangle.size(); ++t) {
    model.mesh.triangle_patch[t] = model.mesh.triangle_material[t];
  }
  const std::uint32_t count = 1 + *std::ranges::max_element(model.mesh.triangle_material);
  model.patches = {};
  model.patches.area.resize(count);
  return model;
}

PatchGeometry geometry_of(const PatchModel& model) {
  return {model, test::make_tracer(model)};
}

Scene two_squares(double distance, double tilt) {
  Scene scene = test::empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  test::add_polygon(scene, std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0);
  const double c = std::cos(tilt), s = std::sin(tilt);
  std::vector<glm::dvec3> upper = {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}};
  for (glm::dvec3& p : upper) p = glm::dvec3(c * p.x, p.y, s * p.x + distance);
  test::add_polygon(scene, upper, 1);
  return scene;
}

double exchange_of_two(const Scene& scene, std::size_t element_count) {
  return unoccluded_exchange_area(geometry_of(model_by_material(scene, element_count)), 0, 1, 1e-4);
}

TEST(PatchGeometry, ManyTrianglesExchangeWhatFewDo) {
  for (const double distance : {0.02, 0.2, 0.5, 1.0, 2.0, 3.0, 6.0, 12.0, 40.0, 100.0}) {
    for (const double tilt : {0.0, 0.4, 1.0}) {
      const Scene scene = two_squares(distance, tilt);
      const double exact = exchange_of_two(scene, 4), many = exchange_of_two(scene, 256);
      EXPECT_NEAR(many / exact, 1, 0.03) << "distance " << distance << ", tilt " << tilt;
    }
  }
}

TEST(PatchGeometry, ACavitySeesItself) {
  // What leaves the inside of a box without a lid hits the box again or leaves by the opening,
  // which sees nothing but the box: F = 1 - opening / inside.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {1, 1, 1}, true);
  scene.triangle.resize(10);  // the last two are the lid
  scene.triangle_material.resize(10);
  const PatchModel model = model_by_material(scene, 640);
  const double exchange = unoccluded_exchange_area(geometry_of(model), 0, 0, 1e-4);
  EXPECT_NEAR(exchange / 5, 1 - 1.0 / 5, 0.03);
}

TEST(PatchGeometry, ARoundedPatchCountsByWhatIsSeenOfIt) {
  // A ball and a small square far off: the ball's silhouette is a quarter of its area.
  Scene scene = test::empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  test::add_ball(scene, 32, 16, false, 0);
  for (Float3& p : scene.position) p[2] -= 30;
  test::add_polygon(
      scene, std::vector<glm::dvec3>{{-.5, -.5, 0}, {-.5, .5, 0}, {.5, .5, 0}, {.5, -.5, 0}}, 1);
  const PatchModel model = model_by_material(scene, 10);
  const PatchGeometry geometry = geometry_of(model);
  const double silhouette = geometry.area(0) / 4;
  EXPECT_NEAR(unoccluded_exchange_area(geometry, 0, 1, 1e-4),
              silhouette / (std::numbers::pi * 30 * 30),
              0.03 * silhouette / (std::numbers::pi * 900));
  EXPECT_FALSE(geometry.bounds(0).is_flat());
  EXPECT_TRUE(geometry.bounds(1).is_flat());
}

TEST(PatchGeometry, BoundsNeverDenyAPairThatExchanges) {
  std::mt19937 engine(5);
  const auto number = [&] { return engine() * 0x1p-32 * 2 - 1; };
  int denied = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Scene scene = test::empty_scene();
    scene.materials.resize(2, scene.materials[0]);
    for (std::uint32_t patch = 0; patch < 2; ++patch) {
      const glm::dvec3 centre(3 * number(), 3 * number(), 3 * number());
      for (int k = 0; k < 3; ++k) {
        const glm::dvec3 p = centre + 0.5 * glm::dvec3(number(), number(), number());
        test::add_polygon(
            scene,
            std::vector<glm::dvec3>{p, p + 0.3 * glm::dvec3(number(), number(), number()),
                                    p + 0.3 * glm::dvec3(number(), number(), number())},
            patch);
      }
    }
    const PatchGeometry geometry = geometry_of(model_by_material(scene, 6));
    const PatchBounds &a = geometry.bounds(0), &b = geometry.bounds(1);
    if (a.may_face(b.centre, b.radius) && b.may_face(a.centre, a.radius)) continue;
    ++denied;
    EXPECT_EQ(unoccluded_exchange_area(geometry, 0, 1, 1e-4), 0) << "trial " << trial;
  }
  EXPECT_GT(denied, 0);
}

}  // namespace
}  // namespace rebounce::test_patch_geometry
