#include "runtime/frame/direct_lighting.h"

#include <gtest/gtest.h>

#include <numbers>

#include "rebounce/error.h"
#include "tests/support/test_scene_data.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_direct_lighting {
namespace {

std::vector<Float3> direct(const TransferData& data, const std::vector<Light>& lights,
                           const Sky& sky = {}) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting lighting(data, tracer);
  std::vector<Float3> irradiance(data.patches.size());
  lighting.compute(lights, sky, irradiance);
  return irradiance;
}

TEST(DirectLighting, PointOverAPlane) {
  // E = I cos / h², cos = h / distance (radiosity_analytic.tsv, POINT_LIGHT_PLANE: h = 2).
  TransferData data;
  test::add_square(data, 4, 0, 80, true, {0.5F, 0.5F, 0.5F});
  Light lamp;
  lamp.position = {0, 2, 0};
  lamp.color = {1, 0.5F, 0};
  const std::vector<Float3> e = direct(data, {lamp});
  double total = 0, total_truth = 0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const glm::dvec3 c = to_dvec3(data.patches.centroid[i]);
    const double r2 = c.x * c.x + 4 + c.z * c.z;
    const double truth = 2 / (r2 * std::sqrt(r2));
    EXPECT_NEAR(e[i][0] / truth, 1, 2e-2);  // the mean of eight points is not quite in the middle
    EXPECT_FLOAT_EQ(e[i][1], 0.5F * e[i][0]);
    EXPECT_EQ(e[i][2], 0);
    total += e[i][0];
    total_truth += truth;
  }
  EXPECT_NEAR(total / total_truth, 1, 5e-4);
}

TEST(DirectLighting, ShadowsFallWhereTheyMust) {
  TransferData data;
  test::add_square(data, 2, 0, 40, true, {0.5F, 0.5F, 0.5F});
  test::add_square(data, 0.5F, 1, 1, true, {0.5F, 0.5F, 0.5F});
  Light lamp;
  lamp.position = {0, 2, 0};
  const std::vector<Float3> e = direct(data, {lamp});
  int dark = 0, lit = 0;
  for (std::size_t i = 0; i + 2 < e.size(); ++i) {
    const Float3& c = data.patches.centroid[i];
    const float reach = std::max(std::abs(c[0]), std::abs(c[2]));
    if (reach < 0.9F) {  // the shadow of the small square is twice its size
      EXPECT_EQ(e[i][0], 0);
      ++dark;
    } else if (reach > 1.1F) {
      EXPECT_GT(e[i][0], 0);
      ++lit;
    }
  }
  EXPECT_GT(dark, 300);
  EXPECT_GT(lit, 1000);
}

TEST(DirectLighting, DirectionalAndSky) {
  TransferData data;
  test::add_square(data, 1, 0, 10, true, {0.5F, 0.5F, 0.5F});
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = {0.6F, -0.8F, 0};
  sun.intensity = 1000;
  Sky sky;
  sky.luminance = 10;
  sky.color = {0, 0, 1};
  for (const Float3& e : direct(data, {sun}, sky)) {
    EXPECT_NEAR(e[0], 800, 1e-2);
    EXPECT_NEAR(e[2], 800 + 10 * std::numbers::pi, 1e-2);
  }
}

TEST(DirectLighting, BacksAreDarkAndLightsAdd) {
  TransferData data;
  test::add_square(data, 1, 0, 10, false, {0.5F, 0.5F, 0.5F});
  Light above, below;
  above.position = {0, 2, 0};
  below.position = {0.3F, -2, 0.1F};
  for (const Float3& e : direct(data, {above})) EXPECT_EQ(e[0], 0);
  const std::vector<Float3> one = direct(data, {below}), two = direct(data, {above, below, below});
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(two[i][0], 2 * one[i][0], 1e-5);
}

TEST(DirectLighting, SameBitsForAnyNumberOfThreads) {
  TransferData data;
  test::add_square(data, 2, 0, 30, true, {0.5F, 0.5F, 0.5F});
  test::add_square(data, 0.5F, 1, 4, true, {0.5F, 0.5F, 0.5F});
  Light lamp;
  lamp.position = {0.2F, 2, 0.1F};
  const auto make = [&] { return direct(data, {lamp}); };
  const std::vector<Float3> one = test::with_threads(1, make), four = test::with_threads(4, make);
  EXPECT_EQ(one, four);
}

TEST(DirectLighting, OnlyChangedLightsAreTraced) {
  TransferData data;
  test::add_square(data, 2, 0, 30, true, {0.5F, 0.5F, 0.5F});
  test::add_square(data, 0.5F, 1, 4, true, {0.5F, 0.5F, 0.5F});
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting lighting(data, tracer);
  std::vector<Light> lights(3);
  for (int k = 0; k < 3; ++k) lights[k].position = {0.3F * static_cast<float>(k), 2, 0.1F};
  std::vector<Float3> first(data.patches.size()), e(data.patches.size());
  lighting.compute(lights, {}, first);
  EXPECT_EQ(lighting.traced_light_count(), 3);
  lights[0].intensity = 7;
  lights[2].color = {1, 0, 0};
  lighting.compute(lights, {}, e);
  EXPECT_EQ(lighting.traced_light_count(), 0);
  EXPECT_EQ(e, direct(data, lights));
  lights[1].position[0] += 1e-3F;
  lighting.compute(lights, {}, e);
  EXPECT_EQ(lighting.traced_light_count(), 1);
  EXPECT_EQ(e, direct(data, lights));
  lights[0].intensity = 0;  // off, and somewhere else when it comes back
  lights[0].position[2] += 1;
  lighting.compute(lights, {}, e);
  EXPECT_EQ(lighting.traced_light_count(), 0);
  EXPECT_EQ(e, direct(data, {lights[1], lights[2]}));
  lighting.compute({}, {}, e);
  EXPECT_EQ(e, std::vector<Float3>(e.size(), Float3{0, 0, 0}));
  for (int k = 0; k < 3; ++k) {
    lights[k] = Light{};
    lights[k].position = {0.3F * static_cast<float>(k), 2, 0.1F};
  }
  lighting.compute(lights, {}, e);
  EXPECT_EQ(e, first);
}

TEST(DirectLighting, RangeLeavesTheFarDark) {
  TransferData data;
  test::add_square(data, 10, 0, 60, true, {0.5F, 0.5F, 0.5F});
  Light lamp;
  lamp.position = {3, 1, 3};
  lamp.range = 2;
  const std::vector<Float3> e = direct(data, {lamp});
  int lit = 0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const float d = glm::distance(to_glm(data.patches.centroid[i]), to_glm(lamp.position));
    if (d > 2.3F) {
      EXPECT_EQ(e[i][0], 0);
    } else if (d < 1.7F) {
      EXPECT_GT(e[i][0], 0);
      ++lit;
    }
  }
  EXPECT_GT(lit, 50);
}

TEST(DirectLighting, ProfileOfALuminaire) {
  TransferData data;
  test::add_square(data, 1, 0, 20, true, {0.5F, 0.5F, 0.5F});
  const auto profile = std::make_shared<IntensityProfile>();
  profile->vertical = {0, std::numbers::pi_v<float> / 2};  // falls linearly to the side
  profile->horizontal = {0};
  profile->candela = {100, 0};
  Light lamp;
  lamp.position = {0, 1, 0};
  lamp.profile = profile;
  lamp.intensity = 2;
  const std::vector<Float3> e = direct(data, {lamp});
  for (std::size_t i = 0; i < e.size(); ++i) {
    const glm::dvec3 c = to_dvec3(data.patches.centroid[i]);
    const double r2 = c.x * c.x + 1 + c.z * c.z, angle = std::acos(1 / std::sqrt(r2));
    const double truth = 200 * (1 - angle / (std::numbers::pi / 2)) / (r2 * std::sqrt(r2));
    EXPECT_NEAR(e[i][0] / truth, 1, 4e-2);
  }
}

TEST(DirectLighting, RoomForMoreLightsIsMadeOnce) {
  TransferData data;
  test::add_square(data, 1, 0, 4, true, {0.5F, 0.5F, 0.5F});
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting lighting(data, tracer, {.light_capacity = 0});
  Light lamp;
  lamp.position = {0, 1, 0};
  const std::vector<Light> lights(5, lamp);
  std::vector<Float3> e(data.patches.size());
  lighting.compute(lights, {}, e);
  EXPECT_EQ(e, direct(data, lights));
}

TEST(DirectLighting, NeedsAPoint) {
  TransferData data;
  test::add_square(data, 1, 0, 1, true, {0.5F, 0.5F, 0.5F});
  const RayTracer tracer = make_surface_tracer(data.mesh);
  EXPECT_THROW(DirectLighting(data, tracer, {.points_per_patch = 0}), Error);
  EXPECT_THROW(DirectLighting(data, tracer, {.area_light_samples = 0}), Error);
  EXPECT_THROW(DirectLighting(data, tracer, {.area_light_samples = 65}), Error);
}

}  // namespace
}  // namespace rebounce::test_direct_lighting
