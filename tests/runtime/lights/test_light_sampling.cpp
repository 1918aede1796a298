#include <gtest/gtest.h>

#include <cmath>

#include "runtime/lights/light_sampling.h"

namespace rebounce::test_light_sampling {
namespace {

constexpr float kPi = 3.14159265358979F;

// Illuminance on a horizontal plane, facing up, at `point`.
float on_floor(const Light& light, const Float3& point) {
  const IncidentLight incident = evaluate_light(light, point);
  return incident.illuminance[0] * incident.direction[1];
}

Light downward_spot() {
  Light light;
  light.type = LightType::kSpot;
  light.position = {0, 1, 0};
  light.direction = {0, -1, 0};
  light.inner_cone_angle = 0.3F;
  light.outer_cone_angle = 0.6F;
  return light;
}

// A floor point in the direction `angle` from the axis of a lamp 1 m above.
Float3 floor_point(float angle) {
  return {std::tan(angle), 0, 0};
}

TEST(LightSampling, PointLightFollowsCosineOverDistanceSquared) {
  Light light;
  light.position = {0, 2, 0};
  EXPECT_NEAR(on_floor(light, {0, 0, 0}), 0.25, 1e-7);
  EXPECT_NEAR(on_floor(light, {2, 0, 0}), 0.0883883476483, 1e-7);
  light.intensity = 80;
  EXPECT_NEAR(on_floor(light, {0, 0, 2}), 80 * 0.0883883476483, 1e-5);
}

TEST(LightSampling, DirectionIsUnitAndPointsAtTheLamp) {
  Light light;
  light.position = {3, 4, 0};
  const IncidentLight incident = evaluate_light(light, {0, 0, 0});
  EXPECT_FLOAT_EQ(incident.distance, 5);
  EXPECT_FLOAT_EQ(incident.direction[0], 0.6F);
  EXPECT_FLOAT_EQ(incident.direction[1], 0.8F);
}

TEST(LightSampling, ColorScalesEachChannel) {
  Light light;
  light.position = {0, 1, 0};
  light.color = {1, 0.5F, 0};
  light.intensity = 8;
  const IncidentLight incident = evaluate_light(light, {0, 0, 0});
  EXPECT_EQ(incident.illuminance, (Float3{8, 4, 0}));
}

TEST(LightSampling, RangeWindowFadesToZero) {
  Light light;
  light.position = {0, 2, 0};
  light.range = 4;
  EXPECT_NEAR(on_floor(light, {0, 0, 0}), 0.25 * (1 - 1.0 / 16), 1e-7);
  light.range = 2;
  EXPECT_EQ(on_floor(light, {0, 0, 0}), 0);
  light.range = 1;
  EXPECT_EQ(on_floor(light, {0, 0, 0}), 0);
}

TEST(LightSampling, SpotIsFullInsideAndDarkOutside) {
  const Light light = downward_spot();
  const auto illuminance = [&](float angle) {
    const IncidentLight incident = evaluate_light(light, floor_point(angle));
    return incident.illuminance[0] * incident.distance * incident.distance;
  };
  EXPECT_NEAR(illuminance(0), 1, 1e-6);
  EXPECT_NEAR(illuminance(0.29F), 1, 1e-6);
  EXPECT_EQ(illuminance(0.61F), 0);
  const double cosine = 0.5 * (std::cos(0.3) + std::cos(0.6));
  EXPECT_NEAR(illuminance(static_cast<float>(std::acos(cosine))), 0.25, 1e-5);
}

TEST(LightSampling, SpotLightsNothingBehindIt) {
  EXPECT_EQ(evaluate_light(downward_spot(), {0, 2, 0}).illuminance[0], 0);
}

TEST(LightSampling, SpotWithEqualAnglesHasASharpEdge) {
  Light light = downward_spot();
  light.inner_cone_angle = light.outer_cone_angle = kPi / 4;
  EXPECT_GT(on_floor(light, floor_point(kPi / 4 - 0.01F)), 0.2F);
  EXPECT_EQ(on_floor(light, floor_point(kPi / 4 + 0.01F)), 0);
}

TEST(LightSampling, DirectionalLightDoesNotFallOff) {
  Light light;
  light.type = LightType::kDirectional;
  light.direction = {0.6F, -0.8F, 0};
  light.intensity = 1000;
  for (const float x : {0.0F, 1e3F}) {
    const IncidentLight incident = evaluate_light(light, {x, 0, 0});
    EXPECT_TRUE(std::isinf(incident.distance));
    EXPECT_FLOAT_EQ(incident.illuminance[1], 1000);
    EXPECT_FLOAT_EQ(incident.direction[0], -0.6F);
    EXPECT_FLOAT_EQ(incident.direction[1], 0.8F);
  }
}

TEST(LightSampling, PointInsideTheLampReceivesNothing) {
  Light light;
  light.position = {1, 2, 3};
  EXPECT_EQ(evaluate_light(light, {1, 2, 3}).illuminance, (Float3{0, 0, 0}));
}

}  // namespace
}  // namespace rebounce::test_light_sampling
