// Direct light by shadow volumes against that by rays from all points.

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "runtime/frame/direct_lighting.h"
#include "runtime/lights/lamp_kind.h"
#include "tests/support/test_scene_data.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_shadow_methods {
namespace {

constexpr unsigned kSeed = 17;

/// Both methods over the same scene.
struct Methods {
  explicit Methods(const TransferData& scene)
      : data(scene),
        tracer(make_surface_tracer(data.mesh)),
        volumes(data, tracer),
        rays(data, tracer, {}, ShadowMethod::kRays),
        by_volumes(data.patches.size()),
        by_rays(data.patches.size()) {}

  void compute(const Light& lamp) {
    volumes.compute({&lamp, 1}, {}, by_volumes);
    rays.compute({&lamp, 1}, {}, by_rays);
  }
  double difference() const { return relative_difference(by_volumes, by_rays, data.patches.area); }

  const TransferData& data;
  RayTracer tracer;
  DirectLighting volumes, rays;
  std::vector<Float3> by_volumes, by_rays;
};

/// The largest and the mean difference over 16 lamps of each kind.
void expect_agreement(const TransferData& data, std::mt19937& engine) {
  // A ray along the edge of a box may go either way: a point of a patch, an eighth of its light.
  constexpr double kLargest = 1e-2, kMean = 1e-3;
  constexpr std::size_t kLeast = 1000;  // patches, of all lamps
  Methods methods(data);
  for (const LampKind* kind : lamp_kinds()) {
    double mean = 0;
    std::size_t lit = 0, dark = 0;
    constexpr int kLamps = 16;
    for (int k = 0; k < kLamps; ++k) {
      Light lamp = test::lamp_in_box(engine, kind->type);
      methods.compute(lamp);
      const double difference = methods.difference();
      EXPECT_LE(difference, kLargest) << kind->name;
      mean += difference / kLamps;
      for (const Float3& e : methods.by_rays) ++(e[0] > 0 ? lit : dark);
    }
    EXPECT_LE(mean, kMean) << kind->name;
    EXPECT_GT(dark, kLeast) << kind->name;
    if (kind->has_place()) {
      EXPECT_GT(lit, kLeast) << kind->name;
    }
  }
}

TEST(ShadowMethods, AgreeInRooms) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  expect_agreement(test::furnished_box(engine, 20), engine);
}

TEST(ShadowMethods, AgreeUnderTheSun) {
  // In the open, so that light without a place arrives.
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  TransferData data;
  test::add_square(data, 2, 0, 20, true, {0.5F, 0.5F, 0.5F});
  test::add_slanted_box(data, {0, 0.6F, 0}, {glm::vec3(0.3F, 0, 0), {0, 0.2F, 0}, {0, 0, 0.5F}},
                        false, 4);
  Methods methods(data);
  Light sun;
  sun.type = LightType::kDirectional;
  for (int k = 0; k < 16; ++k) {
    const float turn = static_cast<float>(k);
    sun.direction = to_float3(glm::normalize(glm::vec3(std::cos(turn), -1, std::sin(turn))));
    methods.compute(sun);
    EXPECT_LE(methods.difference(), 1e-2);
    EXPECT_GT(std::ranges::count(methods.by_rays, Float3{0, 0, 0}), 40);
  }
}

TEST(ShadowMethods, AgreeWhereOnlyTheLargestOccludersAreUsed) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  expect_agreement(test::furnished_box(engine, 200), engine);  // 1206 planes
}

TEST(ShadowMethods, AgreeWhereLightGetsThrough) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  TransferData data = test::furnished_box(engine, 10);
  data.mesh.opacity.triangle_map.assign(data.mesh.triangle.size(), kNone);
  data.mesh.opacity.begin = {0, 1};
  data.mesh.opacity.opacity = {100};
  for (std::size_t t = data.mesh.triangle.size() - 200; t < data.mesh.triangle.size(); ++t) {
    data.mesh.opacity.triangle_map[t] = 0;
  }
  expect_agreement(data, engine);
}

TEST(ShadowMethods, ASlowLampFlickersNoMoreThanWithRays) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = test::furnished_box(engine, 12, 8);
  constexpr int kFrames = 600;
  constexpr double kMost = 1.5;
  for (const LightType type : {LightType::kPoint, LightType::kSphere}) {
    Methods methods(data);
    Light lamp = test::lamp_in_box(engine, type);
    std::vector<Float3> last_volumes, last_rays;
    float of_volumes = 0, of_rays = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      const float turn = 0.5F * std::numbers::pi_v<float> * static_cast<float>(frame) / kFrames;
      lamp.position = {1.7F * std::cos(turn), 1.2F - 0.5F * turn, 1.7F * std::sin(turn)};
      methods.compute(lamp);
      for (std::size_t i = 0; i < last_rays.size(); ++i) {
        of_volumes = std::max(of_volumes, std::abs(methods.by_volumes[i][0] - last_volumes[i][0]));
        of_rays = std::max(of_rays, std::abs(methods.by_rays[i][0] - last_rays[i][0]));
      }
      last_volumes = methods.by_volumes;
      last_rays = methods.by_rays;
    }
    EXPECT_GT(of_rays, 0);
    EXPECT_LE(of_volumes, kMost * of_rays);
    RecordProperty(std::string(lamp_kind(type).name), std::to_string(of_volumes / of_rays));
  }
}

}  // namespace
}  // namespace rebounce::test_shadow_methods
