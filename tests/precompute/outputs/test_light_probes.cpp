#include "precompute/outputs/light_probes.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <numbers>

#include "rebounce/engine.h"
#include "rebounce/outputs.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/brute_force.h"
#include "tests/support/built_scene.h"
#include "tests/support/expect_error.h"

namespace rebounce::test_light_probes {
namespace {

const TransferData& cornell_box() {
  static const TransferData data = [] {
    BuildSettings settings = test::quick_settings(600);
    settings.probes.grid = {4, 3, 4};
    return test::built_scene("cornell_box.gltf", settings);
  }();
  return data;
}

/// Relative L2 errors of the irradiance in many directions at every valid probe.
struct ProbeErrors {
  double harmonics = 0, for_normals = 0;
};

ProbeErrors errors_of_probes(const Engine& engine) {
  const TransferData& data = engine.data();
  const LightProbes& probes = data.probes;
  std::vector<Float3> normals(36);
  write_octahedral_normals(6, normals);
  std::vector<ProbeLight> light(probes.size());
  std::vector<Float3> irradiance(probes.size() * normals.size());
  apply_probes(probes, engine.radiosity(), {}, light);
  irradiance_at_probes(probes, engine.radiosity(), {}, normals, irradiance);
  ProbeErrors sum;
  double total = 0;
  for (std::size_t p = 0; p < light.size(); ++p) {
    if (probes.valid[p] == 0) continue;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      const Float3 truth =
          to_float3(test::irradiance_at(engine, probes.position[p], normals[k], 1 << 13));
      const Float3 by_harmonics = probe_irradiance(light[p], normals[k]);
      const Float3& found = irradiance[p * normals.size() + k];
      for (int c = 0; c < kChannelCount; ++c) {
        sum.harmonics += std::pow(by_harmonics[c] - truth[c], 2);
        sum.for_normals += std::pow(found[c] - truth[c], 2);
        total += truth[c] * truth[c];
      }
    }
  }
  return {std::sqrt(sum.harmonics / total), std::sqrt(sum.for_normals / total)};
}

TEST(LightProbes, IrradianceIsThatOfABruteForceGather) {
  const auto data = std::make_shared<const TransferData>(cornell_box());
  EXPECT_GE(std::ranges::count(data->probes.valid, 1), 40);
  EXPECT_LT(std::ranges::count(data->probes.valid, 1), 48);  // some are within the blocks
  Engine engine(data);
  engine.relight({}, {});
  const ProbeErrors with_lamp = errors_of_probes(engine);
  // Reflected light alone.
  engine.set_emission_scale(3, {0, 0, 0});
  Light light;
  light.position = {0.278F, 0.4F, 0.1F};
  engine.relight({&light, 1}, {});
  const ProbeErrors reflected = errors_of_probes(engine);
  std::printf(
      "relative L2 error of the irradiance: harmonics %.4f reflected, %.4f with the lamp's "
      "surface; for normals %.4f, %.4f\n",
      reflected.harmonics, with_lamp.harmonics, reflected.for_normals, with_lamp.for_normals);
  EXPECT_LE(reflected.harmonics, 0.02);
  EXPECT_LE(reflected.for_normals, 0.02);
  EXPECT_LE(with_lamp.for_normals, 0.02);
  // A small bright surface in view has harmonics beyond degree 2, which the series leaves out.
  EXPECT_LE(with_lamp.harmonics, 0.08);
}

TEST(LightProbes, WhatMovesThroughThemDoesNotPop) {
  const auto data = std::make_shared<const TransferData>(cornell_box());
  Engine engine(data);
  engine.relight({}, {});
  std::vector<ProbeLight> light(data->probes.size());
  apply_probes(data->probes, engine.radiosity(), {}, light);
  // The largest change of the irradiance in one of `steps` from wall to wall, between the blocks
  // and over them, past probes that are within one.
  const auto largest_change = [&](int steps) {
    double largest = 0;
    std::array<Float3, 6> before{};
    for (int k = 0; k <= steps; ++k) {
      const float t = static_cast<float>(k) / static_cast<float>(steps);
      const Float3 place = {0.05F + 0.45F * t, 0.1F + 0.3F * t, 0.25F * t};
      const ProbeLight found = gather_probe_light(data->probes, engine.radiosity(), {}, place);
      EXPECT_GT(found[0][0], 0);
      const ProbeLight same = interpolate_probes(data->probes, light, place);
      for (std::size_t axis = 0; axis < 6; ++axis) {
        Float3 normal{0, 0, 0};
        normal[axis / 2] = axis % 2 == 0 ? 1.0F : -1.0F;
        const Float3 irradiance = probe_irradiance(found, normal);
        EXPECT_NEAR(irradiance[0], probe_irradiance(same, normal)[0], 1e-4 * found[0][0]);
        if (k > 0) {
          largest = std::max(largest, std::abs(double{irradiance[0]} - before[axis][0]));
        }
        before[axis] = irradiance;
      }
    }
    return largest;
  };
  // A jump would stay as large as it is, however small the steps.
  EXPECT_LE(largest_change(1600), 0.3 * largest_change(400));
}

TEST(LightProbes, EveryDirectionIsPatchOrSkyOrBack) {
  // In degree 0, all that is seen adds up to the sphere.
  const TransferData& data = cornell_box();
  EXPECT_FALSE(data.probes.sky_cells.entry_cell.empty());  // the box is open in front
  const LightProbes& probes = data.probes;
  for (std::size_t p = 0; p < probes.size(); ++p) {
    double seen = probes.sky[p][0];
    for (std::uint32_t e = probes.entry_begin[p]; e < probes.entry_begin[p + 1]; ++e) {
      seen += std::numbers::pi * probes.entry_weight[e][0];
    }
    const double sphere = 4 * std::numbers::pi * 0.282095;
    if (probes.valid[p] != 0) {
      // The lamp is measured by itself, more exactly than rays all around measure the rest.
      EXPECT_LE(seen, sphere * (1 + 2e-3));
      EXPECT_GE(seen, 0.7 * sphere);
    } else {
      EXPECT_EQ(seen, 0);
    }
  }
}

TEST(LightProbes, BehindWallsTheyAreNotValid) {
  // A probe close below the one-sided floor sees its back.
  const TransferData& data = cornell_box();
  const RayTracer tracer = make_surface_tracer(data.mesh);
  LightProbes probes;
  const Float3 middle = data.probes.position[1 + 4 * (1 + 3 * 1)];
  probes.position = {middle, {middle[0], -0.02F, middle[2]}};
  trace_probes(data, data.mesh.triangle_patch, tracer, {}, probes);
  EXPECT_EQ(probes.valid, (std::vector<std::uint8_t>{1, 0}));
}

TEST(LightProbes, SameBitsForAnyNumberOfThreads) {
  const TransferData& data = cornell_box();
  const RayTracer tracer = make_surface_tracer(data.mesh);
  LightProbes probes = place_probes(data.mesh, {.grid = {3, 2, 2}});
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  trace_probes(data, data.mesh.triangle_patch, tracer, {}, probes);
  const LightProbes one = probes;
  omp_set_num_threads(4);
  trace_probes(data, data.mesh.triangle_patch, tracer, {}, probes);
  omp_set_num_threads(before);
  EXPECT_EQ(one.entry_weight, probes.entry_weight);
  EXPECT_EQ(one.entry_begin, probes.entry_begin);
  EXPECT_EQ(one.sky, probes.sky);
  EXPECT_EQ(one.valid, probes.valid);
}

TEST(LightProbes, SpacingAndLimits) {
  const TransferData& data = cornell_box();
  const LightProbes probes = place_probes(data.mesh, {.spacing = 0.1F});
  EXPECT_EQ(probes.size(), std::size_t{probes.grid[0]} * probes.grid[1] * probes.grid[2]);
  EXPECT_GE(probes.grid[0], 2U);
  test::expect_error([&] { place_probes(data.mesh, {.spacing = 1e-3F}); }, "larger spacing");
  LightProbes few = place_probes(data.mesh, {.grid = {1, 1, 1}});
  test::expect_error(
      [&] {
        trace_probes(data, data.mesh.triangle_patch, make_surface_tracer(data.mesh),
                     {.ray_count = 3}, few);
      },
      "64 rays");
}

}  // namespace
}  // namespace rebounce::test_light_probes
