// Balances of light in whole builds, which need no reference: what leaves arrives.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "precompute/build/transfer_build.h"
#include "rebounce/engine.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/solvers/solve_radiosity.h"
#include "tests/support/built_scene.h"
#include "tests/support/test_scenes.h"
#include "transfer/operator/transfer_operator.h"

namespace rebounce::test_energy {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

TransferData build(Scene scene, const BuildSettings& settings) {
  BuildReport report;
  return build_transfer_data(std::move(scene), settings, report);
}

/// The sum of area times value, by channel.
std::array<double, 3> flux(const PatchTable& patches, std::span<const Float3> value) {
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < patches.size(); ++i) {
    for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(patches.area[i]) * value[i][c];
  }
  return sum;
}

TEST(Energy, WhatLeavesArrivesOrGetsOut) {
  for (const char* name : {"furnished_room.gltf", "pavilion.gltf"}) {
    const auto data =
        std::make_shared<const TransferData>(test::built_scene(name, test::quick_settings(500)));
    Engine engine(data);
    Light lamp;
    lamp.position = {1.5F, 1.8F, 1.5F};
    lamp.intensity = 100;
    engine.relight({&lamp, 1}, {});
    const PatchTable& patches = data->patches;
    std::vector<Float3> kept(engine.radiosity().begin(), engine.radiosity().end());
    for (std::size_t i = 0; i < kept.size(); ++i) {
      for (float& b : kept[i]) b *= 1 - patches.sky_visibility[i] - patches.absorbed[i];
    }
    const auto arrives = flux(patches, engine.indirect_irradiance()), left = flux(patches, kept);
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(left[c], 0) << name;
      EXPECT_NEAR(arrives[c], left[c], 2 * kDefaultTolerance * left[c]) << name;
    }
  }
}

TEST(Energy, AnOpenBoxUnderASkyThatIsAsBrightIsAFurnace) {
  // Each surface gives off pi L: what it does not reflect of that, it emits.
  constexpr float kLuminance = 100, kExitance = kPi * kLuminance;
  Scene scene = test::empty_scene({0.2F, 0.5F, 0.8F});
  test::add_box(scene, {-1, 0, -1}, {1, 1, 1}, true);
  test::remove_face(scene, test::Face::kHighY);
  const TransferData data = build(std::move(scene), test::quick_settings(600));
  double seen = 0;
  std::vector<Float3> leaving(data.patches.size());
  for (std::size_t i = 0; i < leaving.size(); ++i) {
    const float sky = data.patches.sky_visibility[i];
    seen += static_cast<double>(data.patches.area[i]) * sky;
    for (int c = 0; c < 3; ++c) {
      const float rho = data.patches.reflectance[i][c];
      leaving[i][c] = (1 - rho) * kExitance + rho * kExitance * sky;
    }
  }
  EXPECT_NEAR(seen, 4, 0.04) << "by reciprocity the area of the opening";
  const std::vector<Float3> arriving = product(*data.transfer, leaving);
  for (std::size_t i = 0; i < leaving.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const float rho = data.patches.reflectance[i][c];
      EXPECT_NEAR(leaving[i][c] + rho * arriving[i][c], kExitance, 0.02F * kExitance) << i;
    }
  }
}

TEST(Energy, TheOperatorIsReciprocal) {
  // Area times what arrives at one patch from another is the same the other way round.
  const TransferData data = test::built_scene("furnished_room.gltf", test::quick_settings(500));
  constexpr unsigned kSeed = 7;
  std::mt19937 engine(kSeed);
  std::uniform_int_distribution<std::size_t> any(0, data.patches.size() - 1);
  const std::vector<float>& area = data.patches.area;
  int lit = 0;
  for (int k = 0; k < 30; ++k) {
    const std::size_t i = any(engine), j = any(engine);
    std::vector<Float3> from_i(area.size()), from_j(area.size());
    from_i[i] = from_j[j] = {1, 1, 1};
    const std::vector<Float3> of_i = product(*data.transfer, from_i),
                              of_j = product(*data.transfer, from_j);
    for (int c = 0; c < 3; ++c) {
      const double there = area[i] * of_j[i][c], back = area[j] * of_i[j][c];
      const double scale = std::sqrt(static_cast<double>(area[i]) * area[j]);
      EXPECT_NEAR(there, back, 2e-4 * scale) << i << " " << j << ", seed " << kSeed;
      if (there > 2e-4 * scale) ++lit;
    }
  }
  EXPECT_GT(lit, 45);
}

TEST(Energy, TheOperatorTellsWhatArrivesStraightFromEmitters) {
  TransferData data = test::built_scene("cornell_box.gltf", test::quick_settings(400));
  const std::vector<Float3> by_form_factors = data.emitted_irradiance;
  ASSERT_FALSE(by_form_factors.empty());
  ASSERT_TRUE(data.exchange.empty());
  data.emitted_irradiance.clear();
  const std::vector<Float3> by_operator = irradiance_from_emitters(data);
  double error = 0, whole = 0;
  for (std::size_t i = 0; i < by_operator.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double right = by_form_factors[i][c], off = by_operator[i][c] - right;
      error += data.patches.area[i] * off * off;
      whole += data.patches.area[i] * right * right;
    }
  }
  EXPECT_GT(whole, 0);
  EXPECT_LT(std::sqrt(error / whole), 0.03);
}

TEST(Energy, OutputsInAFurnaceAreUniform) {
  Scene scene = test::furnished_room({0.5F, 0.5F, 0.5F});
  BuildSettings settings = test::quick_settings(600);
  settings.probes.grid = {3, 3, 3};
  settings.probes.ray_count = 512;
  const TransferData data = build(std::move(scene), settings);
  const std::vector<Float3> radiosity(data.patches.size(), {kPi, 2 * kPi, 3 * kPi});
  const std::vector<Float3> normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
  std::vector<Float3> irradiance(data.probes.size() * normals.size());
  irradiance_at_probes(data.probes, radiosity, {}, normals, irradiance);
  int valid = 0;
  for (std::size_t p = 0; p < data.probes.size(); ++p) {
    if (data.probes.valid[p] == 0) continue;
    ++valid;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      for (int c = 0; c < 3; ++c) {
        const float expected = kPi * static_cast<float>(c + 1);
        EXPECT_NEAR(irradiance[p * normals.size() + k][c], expected, 0.02F * expected);
      }
    }
  }
  EXPECT_GT(valid, 20);
}

}  // namespace
}  // namespace rebounce::test_energy
