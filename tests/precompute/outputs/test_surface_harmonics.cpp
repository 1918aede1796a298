#include "precompute/outputs/surface_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/surface_light.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "runtime/rays/sampling.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/brute_force.h"
#include "tests/support/built_scene.h"
#include "tests/support/expect_error.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_surface_harmonics {
namespace {

const std::shared_ptr<const TransferData>& cornell_box() {
  static const auto data = [] {
    BuildSettings settings = test::quick_settings(600);
    settings.surface_harmonics.ray_count = 512;
    return std::make_shared<const TransferData>(test::built_scene("cornell_box.gltf", settings));
  }();
  return data;
}

/// Reflected light alone: a lamp in the box, whose own surface is off.
Engine lit_box() {
  Engine engine(cornell_box());
  engine.set_emission_scale(3, {0, 0, 0});
  Light lamp;
  lamp.position = {0.278F, 0.4F, 0.1F};
  engine.relight({&lamp, 1}, {});
  return engine;
}

/// The irradiance on a surface with normal `bent` from what is above the plane of the point, by
/// brute force: rays spread evenly over the hemisphere, and the radiosity of what each meets.
glm::dvec3 gather(const Engine& engine, const PatchPoint& point, const glm::dvec3& bent) {
  constexpr std::uint32_t kRays = 2048;
  const glm::dmat3 frame = frame_around(to_dvec3(point.normal));
  std::vector<glm::dvec3> direction;
  for (std::uint32_t k = 0; k < kRays; ++k) {
    const glm::dvec2 s = r2_point(k, {0.3, 0.7});
    const double r = std::sqrt(1 - s.x * s.x), phi = 2 * std::numbers::pi * s.y;
    direction.push_back(frame * glm::dvec3(r * std::cos(phi), r * std::sin(phi), s.x));
  }
  const Float3 origin = engine.parts().tracer->offset_point(point.position, point.normal);
  const std::vector<glm::dvec3> met = test::met_radiosity(engine, origin, direction);
  glm::dvec3 sum(0);
  for (std::size_t k = 0; k < met.size(); ++k) {
    sum += std::max(0.0, glm::dot(direction[k], bent)) * met[k];
  }
  return sum * (2.0 / kRays);  // 2 pi / rays, and B / pi
}

TEST(SurfaceHarmonics, BentNormalsSeeWhatABruteForceGatherDoes) {
  const Engine engine = lit_box();
  const DisplayMesh& mesh = engine.data().mesh;
  std::vector<SurfaceLight> patch(engine.data().patches.size()), vertex(mesh.position.size());
  apply_surface_harmonics(engine.data().surface_harmonics, engine.radiosity(), {}, patch);
  reconstruct_at_vertices(mesh, patch, vertex);
  std::vector<Float3> irradiance(mesh.position.size());
  reconstruct_at_vertices(mesh, engine.indirect_irradiance(), irradiance);

  double straight = 0, flat = 0, bent_error = 0, total = 0, straight_total = 0;
  for (std::uint32_t t = 0; t < mesh.surface_count(); t += 5) {
    if (mesh.triangle_patch[t] == kNone) continue;
    const auto [a, b, c] = mesh.triangle[t];
    const auto at = [&](std::uint32_t v) { return to_dvec3(mesh.position[v]); };
    const glm::dvec3 normal = glm::normalize(glm::cross(at(b) - at(a), at(c) - at(a)));
    const PatchPoint middle{to_float3((at(a) + at(b) + at(c)) / 3.0), to_float3(normal)};
    SurfaceLight light{};
    glm::dvec3 shown(0);
    for (const std::uint32_t v : mesh.triangle[t]) {
      shown += to_dvec3(irradiance[v]) / 3.0;
      for (std::size_t k = 0; k < light.size(); ++k) {
        for (std::size_t i = 0; i < 3; ++i) light[k][i] += vertex[v][k][i] / 3;
      }
    }
    const glm::dvec3 unbent = gather(engine, middle, normal);
    straight += glm::dot(shown - unbent, shown - unbent);
    straight_total += glm::dot(unbent, unbent);
    for (int azimuth = 0; azimuth < 4; ++azimuth) {
      const double phi = azimuth * std::numbers::pi / 2 + 0.4, tilt = std::numbers::pi / 5;
      const glm::dvec3 bent =
          frame_around(normal) * glm::dvec3(std::sin(tilt) * std::cos(phi),
                                            std::sin(tilt) * std::sin(phi), std::cos(tilt));
      const glm::dvec3 truth = gather(engine, middle, bent);
      const glm::dvec3 found =
          to_dvec3(bent_irradiance(light, to_float3(shown), middle.normal, to_float3(bent)));
      bent_error += glm::dot(found - truth, found - truth);
      flat += glm::dot(shown - truth, shown - truth);
      total += glm::dot(truth, truth);
    }
  }
  bent_error = std::sqrt(bent_error / total);
  flat = std::sqrt(flat / total);
  straight = std::sqrt(straight / straight_total);
  std::printf(
      "relative L2 error: %.4f on the surface; bent by 36 degrees %.4f, %.4f if that is not "
      "looked at\n",
      straight, bent_error, flat);
  // Degree 1 has all of what is linear in the normal; next to a wall light is not.
  EXPECT_LE(bent_error, 0.1);
  EXPECT_GE(flat, 2 * bent_error);
}

TEST(SurfaceHarmonics, AnEvenHemisphereIsExact) {
  // Of constant radiance above the surface the series is exact for every normal: half of what the
  // normal's own hemisphere shares with it.
  const float luminance = 3;
  SurfaceLight light{};
  for (std::size_t c = 0; c < 3; ++c) {
    light[0][c] = 2 * std::numbers::pi_v<float> * 0.282095F * luminance;
    light[1][c] = std::numbers::pi_v<float> * 0.488603F * luminance;  // up is y
  }
  for (const double tilt : {0.0, 0.5, 1.2, std::numbers::pi / 2}) {
    const Float3 normal{static_cast<float>(std::sin(tilt)), static_cast<float>(std::cos(tilt)), 0};
    EXPECT_NEAR(surface_irradiance(light, normal)[0],
                luminance * std::numbers::pi * (1 + std::cos(tilt)) / 2, 1e-4);
  }
  const Float3 up{0, 1, 0};
  EXPECT_EQ(bent_irradiance(light, {1, 2, 3}, up, up), (Float3{1, 2, 3}));
}

TEST(SurfaceHarmonics, DegreeZeroIsTheHemisphere) {
  // Patches, sky and backs share out 2 pi of every patch.
  const TransferData& data = *cornell_box();
  const SurfaceHarmonics& light = data.surface_harmonics;
  for (std::size_t i = 0; i < data.patches.size(); ++i) {
    double seen = light.sky[i][0];
    for (std::uint32_t e = light.entry_begin[i]; e < light.entry_begin[i + 1]; ++e) {
      seen += std::numbers::pi * light.entry_weight[e][0];
    }
    const double hemisphere = 2 * std::numbers::pi * 0.282095;
    EXPECT_LE(seen, hemisphere * (1 + 1e-4));
    if (data.patches.absorbed[i] == 0) {
      EXPECT_GE(seen, 0.9 * hemisphere);
    }
  }
}

TEST(SurfaceHarmonics, AFrameAllocatesNothing) {
  const TransferData& data = *cornell_box();
  const Engine engine = lit_box();
  std::vector<SurfaceLight> patch(data.patches.size()), vertex(data.mesh.position.size());
  EXPECT_EQ(test::count_allocations([&] {
              apply_surface_harmonics(data.surface_harmonics, engine.radiosity(), {}, patch);
              reconstruct_at_vertices(data.mesh, patch, vertex);
            }),
            0);
  test::expect_error(
      [&] { apply_surface_harmonics(data.surface_harmonics, engine.radiosity(), {}, vertex); },
      "the result");
}

TEST(SurfaceHarmonics, SameBitsForAnyNumberOfThreads) {
  const TransferData& data = *cornell_box();
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const auto make = [&] {
    return trace_surface_harmonics(data, data.mesh.triangle_patch, tracer, {.ray_count = 64});
  };
  const SurfaceHarmonics one = test::with_threads(1, make), four = test::with_threads(4, make);
  EXPECT_EQ(one.entry_weight, four.entry_weight);
  EXPECT_EQ(one.sky, four.sky);
  test::expect_error(
      [&] { trace_surface_harmonics(data, data.mesh.triangle_patch, tracer, {.ray_count = 3}); },
      "16 rays");
}

}  // namespace
}  // namespace rebounce::test_surface_harmonics
