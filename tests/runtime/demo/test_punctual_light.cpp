#include "runtime/demo/bake/punctual_light.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>

#include "rebounce/lights.h"

namespace rebounce::test_punctual_light {
namespace {

TEST(PunctualLight, ShinesFromAfarAsTheLampDoes) {
  Light sphere;
  sphere.type = LightType::kSphere;
  sphere.radius = 0.5F;
  sphere.intensity = 100;
  EXPECT_EQ(punctual_equivalent(sphere).type, LightType::kPoint);
  EXPECT_NEAR(punctual_equivalent(sphere).intensity, 100 * std::numbers::pi * 0.25, 1e-3);

  Light rectangle;
  rectangle.type = LightType::kRectangle;
  rectangle.size = {2, 0.5F};
  rectangle.intensity = 100;
  const Light spot = punctual_equivalent(rectangle);
  EXPECT_EQ(spot.type, LightType::kSpot);
  EXPECT_NEAR(spot.intensity, 100, 1e-4);
  EXPECT_NEAR(spot.outer_cone_angle, std::numbers::pi / 2, 1e-6);
}

TEST(PunctualLight, TakesTheMeanOfAProfile) {
  constexpr float kPi = std::numbers::pi_v<float>;
  // 60 cd downwards, nothing upwards.
  IntensityProfile profile;
  profile.vertical = {0, kPi / 2};
  profile.horizontal = {0};
  profile.candela = {60, 60};
  Light lamp;
  lamp.intensity = 2;
  lamp.profile = std::make_shared<const IntensityProfile>(profile);
  const Light point = punctual_equivalent(lamp);
  EXPECT_NEAR(point.intensity, 2 * 30, 0.5);
  EXPECT_EQ(point.profile, nullptr);
}

TEST(PunctualLight, LeavesPunctualLightsAlone) {
  Light spot;
  spot.type = LightType::kSpot;
  spot.intensity = 7;
  EXPECT_EQ(punctual_equivalent(spot).type, LightType::kSpot);
  EXPECT_EQ(punctual_equivalent(spot).intensity, 7);
}

}  // namespace
}  // namespace rebounce::test_punctual_light
