#include "runtime/frame/receivers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_receivers {
namespace {

constexpr unsigned kSeed = 11;

/// Small squares all over a room, which face any way.
TransferData random_squares(std::mt19937& engine, int count) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  TransferData data;
  for (int k = 0; k < count; ++k) {
    const glm::vec3 corner = 3.0F * any(), along = any();
    const glm::vec3 aside = glm::cross(along, any());
    // Neighbours that face the same way.
    for (int i = 0; i < 8; ++i) {
      const glm::vec3 a = corner + static_cast<float>(i) * 0.1F * along;
      test::add_patch(data, a, a + 0.1F * along, a + 0.1F * aside, {0.5F, 0.5F, 0.5F});
    }
  }
  return data;
}

Light random_lamp(std::mt19937& engine, LightType type) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  Light light;
  light.type = type;
  light.position = to_float3(4.0F * any());
  light.direction = to_float3(glm::normalize(any()));
  light.tangent = to_float3(glm::cross(to_glm(light.direction), any()));
  light.outer_cone_angle = 0.1F + 0.7F * (1 + uniform(engine));
  light.inner_cone_angle = 0.5F * light.outer_cone_angle;
  light.radius = 0.3F;
  light.size = {0.5F, 0.2F};
  if (uniform(engine) > 0.3F) light.range = 3;
  return light;
}

/// Whether `lamp` lights the point, if nothing is in between.
bool lights(const PreparedLight& lamp, const glm::vec3& point, const glm::vec3& normal) {
  if (lamp.has_area()) return lamp.unoccluded_irradiance(point, normal) > 0;
  const UnitLight light = lamp.evaluate(point);
  return light.illuminance * glm::dot(light.direction, normal) > 0;
}

TEST(Receivers, HaveEveryPatchOnceNearItsLike) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = random_squares(engine, 41);  // the last part is not full
  const Receivers receivers(data, {.points_per_patch = 3});
  ASSERT_EQ(receivers.size(), data.patches.size());
  std::vector<std::uint32_t> sorted = receivers.patch;
  std::ranges::sort(sorted);
  for (std::uint32_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  double extent = 0;
  for (const ReceiverBounds& bounds : receivers.bounds) extent += bounds.box.diagonal();
  // Of patches in any order a part would be as large as the room.
  EXPECT_LT(extent / static_cast<double>(receivers.bounds.size()),
            0.6 * box_around(data.mesh.position).diagonal());
}

TEST(Receivers, WhatIsOutOfReachGetsNoLight) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = random_squares(engine, 80);
  const Receivers receivers(data, {.points_per_patch = 2});
  for (const LampKind* kind : lamp_kinds()) {
    int reached_count = 0, out_count = 0, lit_count = 0;
    for (int k = 0; k < 40; ++k) {
      const PreparedLight lamp(random_lamp(engine, kind->type));
      for (std::size_t block = 0; block < receivers.block_count(); ++block) {
        const Receivers::Reached reached = receivers.reached(block, lamp);
        for (std::size_t slot = 0; slot < receivers.slots_in(block); ++slot) {
          const bool may = reached[slot / Receivers::kPart];
          (may ? reached_count : out_count) += 1;
          for (std::size_t j = 0; j < receivers.points_per_patch; ++j) {
            const PatchPointBlock& points = receivers.points(block, j);
            if (!lights(lamp, points.at(slot), points.normal_at(slot))) continue;
            ++lit_count;
            EXPECT_TRUE(may) << kind->name << " " << k;
          }
        }
      }
    }
    EXPECT_GT(out_count, 200) << kind->name;
    EXPECT_GT(reached_count, 2000) << kind->name;
    EXPECT_GT(lit_count, 1000) << kind->name;
  }
}

/// All points of all patches, one by one and in any order of patches.
TEST(Receivers, DirectLightIsThatOfAllPoints) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = random_squares(engine, 41);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  constexpr DirectLightingSettings kSettings{.points_per_patch = 11};  // not all at once
  const Receivers receivers(data, kSettings);
  DirectLighting lighting(data, tracer, kSettings);
  std::vector<Float3> irradiance(data.patches.size());
  int shadowed = 0, lit = 0;
  for (const LightType type : {LightType::kPoint, LightType::kSpot, LightType::kDirectional}) {
    for (int k = 0; k < 10; ++k) {
      const Light light = random_lamp(engine, type);
      const PreparedLight lamp(light);
      lighting.compute({&light, 1}, {}, irradiance);
      for (std::size_t slot = 0; slot < receivers.size(); ++slot) {
        float expected = 0;
        for (std::size_t j = 0; j < receivers.points_per_patch; ++j) {
          const PatchPointBlock& points = receivers.points(slot / Receivers::kBlock, j);
          const glm::vec3 point = points.at(slot % Receivers::kBlock);
          const UnitLight here = lamp.evaluate(point);
          const float arriving =
              here.illuminance *
              glm::dot(here.direction, points.normal_at(slot % Receivers::kBlock));
          if (arriving <= 0) continue;
          Ray ray{.origin = to_float3(point),
                  .t_near = 0,
                  .direction = to_float3(here.direction),
                  .t_far = 0.9999F * here.distance};
          tracer.occluded({&ray, 1});
          (is_occluded(ray) ? shadowed : lit) += 1;
          if (!is_occluded(ray)) {
            expected += arriving / static_cast<float>(receivers.points_per_patch);
          }
        }
        const float found = irradiance[receivers.patch[slot]][0];
        EXPECT_NEAR(found, expected, 1e-5F * expected) << k << ", slot " << slot;
      }
    }
  }
  EXPECT_GT(shadowed, 500);
  EXPECT_GT(lit, 2000);
}

}  // namespace
}  // namespace rebounce::test_receivers
