#include "runtime/frame/lamp_warnings.h"

#include <gtest/gtest.h>

#include "tests/support/test_scene_data.h"

namespace rebounce::test_lamp_warnings {
namespace {

/// A box [low, high] of one-sided patches that face inwards, or outwards.
void add_box(TransferData& data, const glm::vec3& low, const glm::vec3& high, bool inwards) {
  const auto corner = [&](int bits) {
    return glm::vec3((bits & 1) != 0 ? high.x : low.x, (bits & 2) != 0 ? high.y : low.y,
                     (bits & 4) != 0 ? high.z : low.z);
  };
  // Counter-clockwise as seen from outside.
  constexpr std::array<std::array<int, 4>, 6> kFaces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& [a, b, c, d] : kFaces) {
    for (const auto& [i, j, k] : {std::array{a, b, c}, std::array{a, c, d}}) {
      test::add_patch(data, corner(i), corner(inwards ? k : j), corner(inwards ? j : k),
                      {0.5F, 0.5F, 0.5F});
    }
  }
}

/// A room of 4 x 3 x 4 metres around a pillar of 0.6 x 2.8 x 0.6 in its middle.
Engine room_with_pillar() {
  auto data = std::make_shared<TransferData>();
  add_box(*data, {-2, 0, -2}, {2, 3, 2}, true);
  add_box(*data, {-0.3F, 0.1F, -0.3F}, {0.3F, 2.9F, 0.3F}, false);
  test::add_even_exchange(*data);
  return Engine(std::move(data));
}

Light point_at(const Float3& position) {
  Light lamp;
  lamp.position = position;
  return lamp;
}

std::string warning_of(const Engine& engine, const Light& lamp) {
  const std::vector<std::string> warnings = lamp_warnings(engine, {&lamp, 1});
  return warnings.empty() ? "" : warnings.at(0);
}

TEST(LampWarnings, LampsThatLightTheRoomHaveNone) {
  const Engine engine = room_with_pillar();
  std::vector<Light> lamps = {point_at({1, 2, 1}), point_at({-1.99F, 0.01F, 1})};
  Light ceiling = point_at({1, 3, 1});  // a disc just in its surface
  ceiling.type = LightType::kDisc;
  ceiling.radius = 0.2F;
  lamps.push_back(ceiling);
  EXPECT_TRUE(lamp_warnings(engine, lamps).empty());
}

TEST(LampWarnings, ALampInAPillarIsNamed) {
  const Engine engine = room_with_pillar();
  std::vector<Light> lamps = {point_at({1, 2, 1}), point_at({0, 1, 0.1F})};
  lamps[1].name = "desk";
  const std::vector<std::string> warnings = lamp_warnings(engine, lamps);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_TRUE(warnings[0].starts_with("light 1 \"desk\" (point) is inside of a wall"))
      << warnings[0];
}

TEST(LampWarnings, ASphereThatSticksOutOfAPillarShines) {
  Light lamp = point_at({0, 1, 0});
  lamp.type = LightType::kSphere;
  lamp.radius = 0.4F;
  EXPECT_NE(warning_of(room_with_pillar(), lamp).find("has its middle inside"), std::string::npos);
}

TEST(LampWarnings, WhatLightsNothingIsNamed) {
  const Engine engine = room_with_pillar();
  Light far = point_at({1, 2, 1});
  far.range = 1e-3F;
  EXPECT_TRUE(warning_of(engine, far).starts_with("light 0 (point) lights nothing: check its pos"));
  // Outside of the room, where the backs of its walls are seen.
  EXPECT_NE(warning_of(engine, point_at({9, 1, 0})).find("lights nothing"), std::string::npos);
  Light sun;
  sun.type = LightType::kDirectional;
  EXPECT_NE(warning_of(engine, sun).find("no opening"), std::string::npos);
  far.intensity = 0;
  EXPECT_EQ(warning_of(engine, far), "");
}

TEST(LampWarnings, TheFrameOfTheEngineStays) {
  Engine engine = room_with_pillar();
  const Light lamp = point_at({1, 2, 1});
  engine.relight({&lamp, 1}, {});
  const std::vector<Float3> before(engine.direct_irradiance().begin(),
                                   engine.direct_irradiance().end());
  EXPECT_EQ(warning_of(engine, point_at({-1, 1, 1})), "");
  EXPECT_TRUE(std::ranges::equal(before, engine.direct_irradiance()));
}

}  // namespace
}  // namespace rebounce::test_lamp_warnings
