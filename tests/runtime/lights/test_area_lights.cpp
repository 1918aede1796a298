// Lamps with a surface against closed forms.

#include <gtest/gtest.h>

#include <numbers>

#include "runtime/frame/direct_lighting.h"
#include "runtime/lights/light_sampling.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_area_lights {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<Float3> direct(const TransferData& data, const std::vector<Light>& lights,
                           const DirectLightingSettings& settings = {}) {
  const RayTracer tracer = make_surface_tracer(data.mesh);
  DirectLighting lighting(data, tracer, settings);
  std::vector<Float3> irradiance(data.patches.size());
  lighting.compute(lights, {}, irradiance);
  return irradiance;
}

/// One patch so small that its irradiance is that of its middle, the origin, facing `normal`.
TransferData tiny_patch(const glm::vec3& normal) {
  const glm::vec3 x = glm::normalize(glm::cross(normal, glm::vec3(0.3F, 0.5F, -0.8F))),
                  y = glm::cross(normal, x);
  TransferData data;
  test::add_patch(data, 1e-3F * x, 1e-3F * (-0.5F * x + y), 1e-3F * (-0.5F * x - y),
                  {0.5F, 0.5F, 0.5F});
  return data;
}

Light sphere_at(const Float3& position, float radius) {
  Light light;
  light.type = LightType::kSphere;
  light.position = position;
  light.radius = radius;
  return light;
}

Light rectangle_at(const Float3& position, const Float2& size) {
  Light light;
  light.type = LightType::kRectangle;
  light.position = position;
  light.size = size;
  return light;
}

Light disc_at(const Float3& position, float radius) {
  Light light;
  light.type = LightType::kDisc;
  light.position = position;
  light.radius = radius;
  return light;
}

TEST(AreaLights, SphereOverheadIsLuminanceTimesSineSquared) {
  // E = pi L sin²(half angle) cos(angle to the middle), sphere wholly above the horizon.
  const double e = direct(tiny_patch({0, 1, 0}), {sphere_at({0.6F, 0.8F, 0}, 0.25F)})[0][0];
  EXPECT_NEAR(e / (kPi * 0.0625 * 0.8), 1, 2e-3);
}

TEST(AreaLights, SphereCutInHalfByTheHorizonIsItsClosedForm) {
  // Seen by half, edge on: (half angle - sin cos of it) / pi of a full sky.
  const double half = std::asin(0.5);
  const double truth = half - std::sin(half) * std::cos(half);
  EXPECT_NEAR(direct(tiny_patch({0, 1, 0}), {sphere_at({1, 0, 0}, 0.5F)})[0][0], truth,
              4e-3 * truth);
}

TEST(AreaLights, RectangleFacingItsCornerIsTheFormulaOfTheBooks) {
  // Element under a corner of a parallel rectangle (Howell, B-4 doubled by symmetry about it):
  // F = (1 / 2 pi) (A/sqrt(1+A²) atan(B/sqrt(1+A²)) + B/sqrt(1+B²) atan(A/sqrt(1+B²))).
  const double a = 0.8 / 0.5, b = 0.6 / 0.5, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  const double factor = (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi);
  Light light = rectangle_at({0.4F, 0.5F, 0.3F}, {0.8F, 0.6F});
  EXPECT_NEAR(direct(tiny_patch({0, 1, 0}), {light})[0][0] / (kPi * factor), 1, 4e-3);
  // Turned by the tangent.
  light.tangent = {0.3F, 5, 1};
  light.position = {0, 0.5F, 0};
  light.size = {3, 0.01F};
  const glm::vec3 along = glm::normalize(glm::vec3(0.3F, 0, 1));
  const IncidentLight end = evaluate_light(light, {0, 0, 0}, {1, 0.5F});
  EXPECT_NEAR(glm::dot(to_glm(end.direction) * end.distance, along), 1.5F, 1e-5);
}

TEST(AreaLights, RectangleShinesOnOneSide) {
  Light light = rectangle_at({0, 1, 0}, {1, 1});
  EXPECT_GT(direct(tiny_patch({0, 1, 0}), {light})[0][0], 0);
  light.direction = {0, 1, 0};
  EXPECT_EQ(direct(tiny_patch({0, 1, 0}), {light})[0][0], 0);
}

TEST(AreaLights, FarAwayTheyArePoints) {
  Light point;
  point.position = {3, 4, 0};
  Light sphere = sphere_at(point.position, 0.05F);
  sphere.intensity = static_cast<float>(1 / (kPi * 0.05 * 0.05));  // 1 cd
  const TransferData data = tiny_patch({0, 1, 0});
  EXPECT_NEAR(direct(data, {sphere})[0][0] / direct(data, {point})[0][0], 1, 1e-3);
}

TEST(AreaLights, HalfShadowIsThePartOfTheLampThatIsSeen) {
  // A half plane (a large square from x = 0 on, at half height) over a floor: of a square lamp of
  // side 1 the floor point x sees the part right of 2 * 0 - x: linear in x, by similar triangles.
  TransferData data;
  test::add_square(data, 1, 0, 24, true, {0.5F, 0.5F, 0.5F});
  const std::size_t floor_count = data.patches.size();
  const glm::vec3 a(0, 1, -9), b(0, 1, 9), c(9, 1, 9), d(9, 1, -9);
  test::add_patch(data, a, b, c, {0.5F, 0.5F, 0.5F});
  test::add_patch(data, a, c, d, {0.5F, 0.5F, 0.5F});
  const Light lamp = rectangle_at({0, 2, 0}, {1, 1});
  const std::vector<Float3> e = direct(data, {lamp}, {.area_light_samples = 16});
  TransferData open;
  test::add_square(open, 1, 0, 24, true, {0.5F, 0.5F, 0.5F});
  const std::vector<Float3> whole = direct(open, {lamp});
  double error = 0, total = 0;
  int half = 0;
  for (std::size_t i = 0; i < floor_count; ++i) {
    const double x = data.patches.centroid[i][0];
    const double seen = std::clamp(0.5 - x, 0.0, 1.0);
    half += seen > 0.1 && seen < 0.9 ? 1 : 0;
    error += std::abs(e[i][0] - seen * whole[i][0]);
    total += whole[i][0];
    EXPECT_NEAR(e[i][0] / whole[i][0], seen, 0.09);
  }
  EXPECT_GT(half, 300);
  EXPECT_LT(error / total, 0.02);
}

TEST(AreaLights, AreKeptAndRepeatTheirBits) {
  TransferData data;
  test::add_square(data, 1, 0, 10, true, {0.5F, 0.5F, 0.5F});
  test::add_square(data, 0.3F, 0.5F, 3, true, {0.5F, 0.5F, 0.5F});
  const std::vector<Light> here = {sphere_at({0, 1, 0}, 0.2F), rectangle_at({0.2F, 1, 0}, {1, 1})};
  std::vector<Light> there = here;
  there[1].size = {0.5F, 1};
  EXPECT_NE(direct(data, here), direct(data, there));
  EXPECT_EQ(direct(data, here), direct(data, here));
}

TEST(DiscLight, FacingElementsAreThatOfTheCatalogue) {
  // Howell, B-13: from an element parallel to the disc, at height h and off its axis by d.
  for (const float d : {0.0F, 0.3F, 1.0F, 4.0F}) {
    const double h = 1.5, r = 0.8;
    const double z = h * h + d * d + r * r;
    const double factor =
        0.5 * (1 - (h * h + d * d - r * r) / std::sqrt(z * z - 4 * r * r * d * d));
    const std::vector<Float3> e =
        direct(tiny_patch({0, 1, 0}), {disc_at({d, static_cast<float>(h), 0}, 0.8F)});
    EXPECT_NEAR(e[0][0], kPi * factor, 1e-5 * kPi) << d;
  }
}

TEST(DiscLight, ElementsAtRightAnglesAreThatOfTheCatalogue) {
  // Howell, B-11: the disc stands on the bright side of the element,
  // whose plane is parallel to its axis.
  for (const float d : {1.0F, 2.0F}) {
    const double h = 1.2, r = 0.6, big_h = h / d, big_r = r / d;
    const double z = 1 + big_h * big_h + big_r * big_r;
    const double factor = 0.5 * big_h * (z / std::sqrt(z * z - 4 * big_r * big_r) - 1);
    const std::vector<Float3> e =
        direct(tiny_patch({1, 0, 0}), {disc_at({d, static_cast<float>(h), 0}, 0.6F)});
    EXPECT_NEAR(e[0][0], kPi * factor, 1e-5 * kPi) << d;
  }
}

TEST(DiscLight, ShinesOnOneSideAndFromAfarLikeASpot) {
  Light disc = disc_at({0, 1, 0}, 0.5F);
  disc.direction = {0, 1, 0};
  EXPECT_EQ(direct(tiny_patch({0, 1, 0}), {disc})[0][0], 0);
  const Light far = disc_at({0, 100, 0}, 0.5F);
  EXPECT_NEAR(direct(tiny_patch({0, 1, 0}), {far})[0][0], kPi * 0.25 / 1e4, 1e-8);
}

}  // namespace
}  // namespace rebounce::test_area_lights
