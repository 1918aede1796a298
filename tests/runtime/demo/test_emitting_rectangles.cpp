// Which emitting surface is as well described by rectangle lamps.

#include "runtime/demo/shading/emitting_rectangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <random>

#include "runtime/rays/float3_glm.h"
#include "tests/support/rectangle_scene.h"

namespace rebounce::test_emitting_rectangles {
namespace {

using test::SceneBuilder;

/// A rectangle in the plane of `origin`, `u` and `v`, whose front is along u x v.
std::array<Float3, 4> rectangle(const glm::vec3& origin, const glm::vec3& u, const glm::vec3& v) {
  return {to_float3(origin), to_float3(origin + u), to_float3(origin + u + v),
          to_float3(origin + v)};
}

/// Adds a rectangle in 3 x 2 pieces.
void add_in_pieces(SceneBuilder& scene, const glm::vec3& origin, const glm::vec3& u,
                   const glm::vec3& v, std::uint32_t material) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 2; ++j) {
      const glm::vec3 corner =
          origin + static_cast<float>(i) / 3 * u + static_cast<float>(j) / 2 * v;
      scene.add_rectangle(rectangle(corner, u / 3.0F, v / 2.0F), material);
    }
  }
}

TEST(EmittingRectangles, AreFoundInAnyPlace) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> number(-1, 1);
  const auto any = [&] { return glm::vec3(number(random), number(random), number(random)); };
  for (int k = 0; k < 20; ++k) {
    SceneBuilder scene;
    scene.add_material({0.5F, 0.5F, 0.5F});
    const std::uint32_t lamp = scene.add_material({0.5F, 0.5F, 0.5F}, {100, 200, 50});
    scene.add_rectangle(test::floor_corners(3), 0);
    const glm::vec3 u = 0.1F + glm::abs(any());
    const glm::vec3 v = glm::cross(u, glm::normalize(any() + glm::vec3(0, 0, 3)));
    scene.add_rectangle(rectangle(any(), u, v), lamp);
    const EmittingRectangles found = find_emitting_rectangles(scene.data(), 4);
    ASSERT_EQ(found.lamps.size(), 1U);
    const Light& light = found.lamps.front();
    EXPECT_EQ(light.type, LightType::kRectangle);
    EXPECT_FLOAT_EQ(light.intensity, 200);
    EXPECT_FLOAT_EQ(light.color[0], 0.5F);
    EXPECT_FLOAT_EQ(light.color[1], 1);
    // The first side may be either.
    const bool is_turned = std::abs(glm::dot(to_glm(light.tangent), u)) < 0.5F * glm::length(u);
    EXPECT_NEAR(light.size[0], glm::length(is_turned ? v : u), 1e-4);
    EXPECT_NEAR(light.size[1], glm::length(is_turned ? u : v), 1e-4);
    EXPECT_NEAR(std::abs(glm::dot(to_glm(light.tangent), glm::normalize(is_turned ? v : u))), 1,
                1e-4);
    EXPECT_LT(glm::distance(to_glm(light.direction), glm::normalize(glm::cross(u, v))), 1e-4F);
    EXPECT_EQ(found.is_lamp, (std::vector<bool>{false, true}));
    EXPECT_FALSE(found.leave_any(scene.data()));
  }
}

TEST(EmittingRectangles, OfManyPatchesAreOneAndTheBrightestComeFirst) {
  SceneBuilder scene;
  const std::uint32_t dim = scene.add_material({0, 0, 0}, {10, 10, 10});
  add_in_pieces(scene, {0, 0, 0}, {3, 0, 0}, {0, 1, 0}, dim);
  add_in_pieces(scene, {0, 5, 0}, {4, 0, 0}, {0, 1, 0}, dim);
  EmittingRectangles found = find_emitting_rectangles(scene.data(), 4);
  ASSERT_EQ(found.lamps.size(), 2U);
  EXPECT_NEAR(found.lamps[0].position[0], 2, 1e-5);
  EXPECT_NEAR(found.lamps[1].position[0], 1.5, 1e-5);
  found = find_emitting_rectangles(scene.data(), 1);
  ASSERT_EQ(found.lamps.size(), 1U);
  EXPECT_NEAR(found.lamps[0].position[1], 5.5, 1e-5);
  EXPECT_TRUE(found.leave_any(scene.data()));
  EXPECT_EQ(std::ranges::count(found.is_lamp, true), 6);
}

TEST(EmittingRectangles, ShineFromBothSidesIfTheMaterialDoes) {
  SceneBuilder scene;
  scene.add_rectangle(rectangle({0, 1, 0}, {1, 0, 0}, {0, 1, 0}),
                      scene.add_material({0, 0, 0}, {10, 10, 10}));
  scene.make_double_sided();
  const EmittingRectangles found = find_emitting_rectangles(scene.data(), 4);
  ASSERT_EQ(found.lamps.size(), 2U);
  EXPECT_EQ(found.lamps[0].direction[2], -found.lamps[1].direction[2]);
}

TEST(EmittingRectangles, NothingElseIsTakenForOne) {
  const auto found_in = [](SceneBuilder& scene) {
    return find_emitting_rectangles(scene.data(), 4).lamps.size();
  };
  {
    SceneBuilder an_l;
    const std::uint32_t lamp = an_l.add_material({0, 0, 0}, {10, 10, 10});
    an_l.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    an_l.add_rectangle(rectangle({1, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    an_l.add_rectangle(rectangle({0, 1, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    EXPECT_EQ(found_in(an_l), 0U);
  }
  {
    SceneBuilder a_corner;
    const std::uint32_t lamp = a_corner.add_material({0, 0, 0}, {10, 10, 10});
    a_corner.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    a_corner.add_rectangle(rectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1}), lamp);
    EXPECT_EQ(found_in(a_corner), 0U);
  }
  {
    SceneBuilder a_rhomb;
    const std::uint32_t lamp = a_rhomb.add_material({0, 0, 0}, {10, 10, 10});
    a_rhomb.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0.1F, 1, 0}), lamp);
    EXPECT_EQ(found_in(a_rhomb), 0U);
  }
  {
    SceneBuilder a_picture;
    const std::uint32_t lamp = a_picture.add_material({0, 0, 0}, {10, 10, 10});
    a_picture.data().materials[lamp].emissive_texture = 0;
    a_picture.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    EXPECT_EQ(found_in(a_picture), 0U);
  }
  {
    SceneBuilder a_part;  // of a patch
    const std::uint32_t lamp = a_part.add_material({0, 0, 0}, {10, 10, 10});
    a_part.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    a_part.data().patches.area[0] *= 2;
    EXPECT_EQ(found_in(a_part), 0U);
  }
  {
    SceneBuilder uneven;
    const std::uint32_t lamp = uneven.add_material({0, 0, 0}, {10, 10, 10});
    uneven.add_rectangle(rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    uneven.add_rectangle(rectangle({1, 0, 0}, {1, 0, 0}, {0, 1, 0}), lamp);
    uneven.data().patches.emitted_exitance[1][0] *= 1.1F;
    EXPECT_EQ(found_in(uneven), 0U);
  }
}

}  // namespace
}  // namespace rebounce::test_emitting_rectangles
