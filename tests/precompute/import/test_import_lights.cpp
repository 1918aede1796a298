// What the importer makes of lights and cameras.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/precompute/import/imported_triangle.h"

namespace rebounce::test_import_lights {
namespace {

using test::expect_near;
using test::json;
using ImportLights = test::ImportedTriangle;

json light_node(int light, json node = json::object()) {
  node["extensions"]["KHR_lights_punctual"]["light"] = light;
  return node;
}

TEST_F(ImportLights, LightsStandWhereTheirNodesAre) {
  triangle_.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.5, 0.25}}, {"intensity", 80}, {"range", 7}},
      {{"type", "spot"},
       {"intensity", 5},
       {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
      {{"type", "directional"}, {"name", "Sun"}}};
  // Turned by -90 degrees about x: -z becomes -y. Scale must not touch the intensity.
  const double half = std::sqrt(0.5);
  triangle_.add_node(light_node(0, {{"name", "Bulb"}, {"translation", {1, 2, 3}}}));
  triangle_.add_node(light_node(
      1, {{"translation", {4, 5, 6}}, {"rotation", {-half, 0, 0, half}}, {"scale", {9, 9, 9}}}));
  triangle_.add_node(light_node(2, {{"scale", {1, 1, -1}}}));
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.lights.size(), 3U);
  const Light& point = scene.lights[0];
  EXPECT_EQ(point.type, LightType::kPoint);
  EXPECT_EQ(point.name, "Bulb");
  expect_near(point.position, {1, 2, 3});
  EXPECT_EQ(point.color, (Float3{1, 0.5F, 0.25F}));
  EXPECT_EQ(point.intensity, 80);
  EXPECT_EQ(point.range, 7);
  const Light& spot = scene.lights[1];
  EXPECT_EQ(spot.type, LightType::kSpot);
  expect_near(spot.position, {4, 5, 6});
  expect_near(spot.direction, {0, -1, 0});
  EXPECT_EQ(spot.intensity, 5);
  EXPECT_EQ(spot.range, 0);
  EXPECT_EQ(spot.inner_cone_angle, 0.25F);
  EXPECT_EQ(spot.outer_cone_angle, 0.5F);
  const Light& sun = scene.lights[2];
  EXPECT_EQ(sun.type, LightType::kDirectional);
  EXPECT_EQ(sun.name, "Sun");
  expect_near(sun.direction, {0, 0, 1});
  EXPECT_EQ(sun.color, (Float3{1, 1, 1}));
  EXPECT_EQ(sun.intensity, 1);
}

TEST_F(ImportLights, LightsThatCannotBeUsedAreLeftOutWithAWarning) {
  triangle_.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", -1}},
      {{"type", "area"}},
      {{"type", "directional"}},
      {{"type", "point"}, {"color", {1, -1, 1}}},
      {{"type", "point"}, {"color", {1e30, 1, 1}}, {"intensity", 1e30}}};
  for (int i = 0; i < 5; ++i) triangle_.add_node(light_node(i, {{"scale", {0, 0, 0}}}));
  const Scene scene = import(triangle_);
  EXPECT_TRUE(scene.lights.empty());
  EXPECT_EQ(scene.warnings.size(), 5U);
}

TEST_F(ImportLights, CamerasLookAlongTheirNodes) {
  triangle_.add("cameras", {{"type", "perspective"},
                            {"name", "View"},
                            {"perspective", {{"yfov", 0.75}, {"znear", 0.1}}}});
  triangle_.add("cameras",
                {{"type", "orthographic"},
                 {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 10}}}});
  // Turned by 90 degrees about y: the camera's -z becomes -x.
  const double half = std::sqrt(0.5);
  triangle_.add_node({{"camera", 0},
                      {"translation", {1, 2, 3}},
                      {"rotation", {0, half, 0, half}},
                      {"scale", {2, 3, 4}}});
  triangle_.add_node({{"camera", 1}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.cameras.size(), 1U);
  const Camera& camera = scene.cameras[0];
  EXPECT_EQ(camera.name, "View");
  expect_near(camera.position, {1, 2, 3});
  expect_near(camera.backward, {1, 0, 0});
  expect_near(camera.up, {0, 1, 0});
  expect_near(camera.right, {0, 0, -1});
  EXPECT_EQ(camera.vertical_fov, 0.75F);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("cameras[1]"), std::string::npos);
}

}  // namespace
}  // namespace rebounce::test_import_lights
