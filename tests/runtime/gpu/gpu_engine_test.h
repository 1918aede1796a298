#pragma once

// Scenes and lamps for engines on the graphics card.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "rebounce/engine.h"
#include "runtime/lights/light_sampling.h"
#include "tests/gl/gl_context.h"
#include "tests/support/hierarchical_samples.h"
#include "tests/support/test_scene_data.h"
#include "transfer/format/hierarchical_encoding.h"

namespace rebounce::test {

inline constexpr std::size_t kPatches = 324;  // not a multiple of the alignment

/// Two squares with an operator of random values and random weights of their vertices.
inline std::shared_ptr<const TransferData> squares_with(const HierarchicalStorage& storage,
                                                        Precision precision) {
  auto data = std::make_shared<TransferData>();
  add_square(*data, 1, 0, 9, true, {0.5F, 0.4F, 0.3F});
  add_square(*data, 1, 2, 9, false, {0.2F, 0.7F, 0.9F});
  data->patches.emitted_exitance[3] = {1, 2, 3};
  data->patches.area = storage.area;
  data->transfer = std::make_shared<const HierarchicalOperator>(encode_values(storage, precision));
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<float> uniform(-0.2F, 0.8F);
  DisplayMesh& mesh = data->mesh;
  mesh.weight_begin = {0};
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    for (std::size_t k = 0; k < v % 4; ++k) {
      mesh.weight_patch.push_back(static_cast<std::uint32_t>(engine() % kPatches));
      mesh.weight.push_back(uniform(engine));
    }
    mesh.weight_begin.push_back(static_cast<std::uint32_t>(mesh.weight.size()));
  }
  return data;
}

inline std::shared_ptr<const TransferData> nested_squares() {
  return squares_with(random_nested_storage(kPatches, 3, 7), Precision::kQ8);
}

/// A context of OpenGL 4.3, or the test is skipped.
class GpuEngineTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!context_.is_current()) GTEST_SKIP() << "there is no OpenGL 4.3 on this machine";
  }

  GlContext context_;
};

inline Light light_of_type(LightType type) {
  Light light;
  light.type = type;
  light.radius = 1;
  return light;
}

inline std::vector<GpuLamp> a_lamp_of_each_kind() {
  Light point = light_of_type(LightType::kPoint);
  point.position = {0.3F, 1.2F, 0.4F};
  point.color = {1, 0.5F, 0.25F};
  point.intensity = 50;
  point.range = 9;
  Light spot = point;
  spot.type = LightType::kSpot;
  spot.direction = {0, -0.6F, 0.8F};
  spot.range = 0;
  spot.inner_cone_angle = 0.2F;
  spot.outer_cone_angle = 1;
  Light sun = light_of_type(LightType::kDirectional);
  sun.direction = {0.6F, -0.8F, 0};
  return {{.light = point}, {.light = spot}, {.light = sun}};
}

/// The direct irradiance of `lamps` by their formulas, without shadows.
inline std::vector<Float3> unshadowed(const TransferData& data, std::span<const GpuLamp> lamps) {
  const std::vector<ReceiverPoint> points = receiver_points(data);
  const std::size_t of_patch = points.size() / data.patches.size();
  std::vector<Float3> irradiance(data.patches.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto& [position, normal] = points[k];
    for (const GpuLamp& lamp : lamps) {
      const IncidentLight light = evaluate_light(lamp.light, position, {});
      const float cosine =
          std::max(0.0F, light.direction[0] * normal[0] + light.direction[1] * normal[1] +
                             light.direction[2] * normal[2]);
      for (int c = 0; c < kChannelCount; ++c) {
        irradiance[k / of_patch][c] += light.illuminance[c] * cosine / static_cast<float>(of_patch);
      }
    }
  }
  return irradiance;
}

}  // namespace rebounce::test
