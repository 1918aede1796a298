// What probes and surface harmonics see of surfaces that lie in one another, and of a sky that is
// not the same in all directions.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/outputs/light_probes.h"
#include "precompute/outputs/surface_harmonics.h"
#include "precompute/patches/hit_patch.h"
#include "rebounce/sky.h"
#include "runtime/lights/sky_light.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/probe_light.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "runtime/outputs/surface_light.h"
#include "runtime/rays/sampling.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_seen_light {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegreeZero = 0.282095;

/// What probes and surface harmonics are made from.
struct SeenScene {
  TransferData data;
  std::vector<std::uint32_t> shown_patch;

  SeenScene(Scene scene, std::size_t patch_count) {
    PatchModel model = make_patch_model(std::move(scene), {.patch_count = patch_count});
    shown_patch = std::move(model.shown_patch);
    data = test::data_of(std::move(model));
  }

  RayTracer tracer() const { return make_surface_tracer(data.mesh); }

  LightProbes probes_at(std::vector<Float3> position, int ray_count) const {
    LightProbes probes;
    probes.position = std::move(position);
    trace_probes(data, shown_patch, tracer(), {.ray_count = ray_count}, probes);
    return probes;
  }
};

/// Turned a little, so that planes are not where floats are exact.
glm::dvec3 turned(const glm::dvec3& v) {
  const double c = std::cos(0.3), s = std::sin(0.3);
  return {c * v.x - s * v.y, s * v.x + c * v.y, v.z};
}

/// A room with an open crate on its floor, all of them sheets: the bottom of the crate and the
/// floor lie in one another.
const SeenScene& room_with_a_crate() {
  static const SeenScene room = [] {
    Scene scene = test::empty_scene();
    scene.materials.front().double_sided = true;
    test::add_box(scene, {0.5, 0, 0.5}, {1.5, 0.5, 1.5}, false);
    test::remove_face(scene, test::Face::kHighY);
    test::add_box(scene, {0, 0, 0}, {2, 2, 2}, true);
    for (Float3& p : scene.position) p = to_float3(turned(to_dvec3(p)));
    for (Float3& n : scene.normal) n = to_float3(turned(to_dvec3(n)));
    return SeenScene(std::move(scene), 200);
  }();
  return room;
}

std::vector<Float3> places_around_the_crate() {
  return {to_float3(turned({1, 1.5, 1})), to_float3(turned({1, 0.25, 1})),
          to_float3(turned({0.2, 0.1, 1}))};
}

/// Rays towards the bottom of the crate that meet a side without a patch of its own.
int count_covered_hits(const SeenScene& room) {
  const RayTracer tracer = room.tracer();
  const glm::dvec3 eye = turned({1, 1.5, 1});
  int covered = 0;
  for (std::uint32_t k = 0; k < 4096; ++k) {
    const glm::dvec2 s = 0.5 + r2_point(k, {0.3, 0.7});
    std::array<Ray, 1> ray{};
    ray[0].origin = to_float3(eye);
    ray[0].direction = to_float3(glm::normalize(turned({s.x, 0, s.y}) - eye));
    ray[0].t_far = std::numeric_limits<float>::infinity();
    std::array<Hit, 1> hit;
    tracer.intersect(ray, hit);
    if (hit[0].triangle == kNone) continue;
    covered += patch_at(room.data.mesh, room.data.mesh.triangle_patch, hit[0]) == kNone ? 1 : 0;
  }
  return covered;
}

TEST(SeenLight, ProbesLoseNothingWhereACrateStandsOnAFloor) {
  const SeenScene& room = room_with_a_crate();
  EXPECT_GT(count_covered_hits(room), 40);
  const LightProbes probes = room.probes_at(places_around_the_crate(), 4096);
  for (std::size_t p = 0; p < probes.size(); ++p) {
    double seen = probes.sky[p][0];
    for (std::uint32_t e = probes.entry_begin[p]; e < probes.entry_begin[p + 1]; ++e) {
      seen += kPi * probes.entry_weight[e][0];
    }
    // In a closed room all of the sphere is patches; a ray or two may slip through an edge.
    EXPECT_NEAR(seen / (4 * kPi * kDegreeZero), 1, 2e-3) << p;
  }
}

TEST(SeenLight, SurfaceHarmonicsLoseNothingThere) {
  const SeenScene& room = room_with_a_crate();
  const SurfaceHarmonics light =
      trace_surface_harmonics(room.data, room.shown_patch, room.tracer(), {.ray_count = 512});
  double all = 0;
  for (std::size_t i = 0; i < room.data.patches.size(); ++i) {
    double seen = light.sky[i][0];
    for (std::uint32_t e = light.entry_begin[i]; e < light.entry_begin[i + 1]; ++e) {
      seen += kPi * light.entry_weight[e][0];
    }
    EXPECT_GE(seen / (2 * kPi * kDegreeZero), 0.99) << i;
    all += seen;
  }
  EXPECT_NEAR(all / (2 * kPi * kDegreeZero * static_cast<double>(room.data.patches.size())), 1,
              1e-3);
}

/// A floor, a wall that stands on it in the west and one in the north, under the open sky.
const SeenScene& yard() {
  static const SeenScene scene = [] {
    Scene walls = test::empty_scene();
    test::add_box(walls, {-2, 0, -2}, {2, 2, 2}, true);
    for (const test::Face open : {test::Face::kHighZ, test::Face::kHighY, test::Face::kHighX}) {
      test::remove_face(walls, open);
    }
    return SeenScene(std::move(walls), 100);
  }();
  return scene;
}

/// A clear sky whose sun is low in the east, over dark ground.
Sky sunset() {
  return {.color = {1, 0.8F, 0.5F},
          .luminance = 1000,
          .distribution =
              std::make_shared<const SkyDistribution>(cie_sky(kCieClearSky, {-1, -0.1F, 0}, 0))};
}

/// Rays from `position` that leave the scene, of `count` in directions make(k).
template <typename Make>
std::vector<Float3> open_directions(const SeenScene& scene, const Float3& position, int count,
                                    const Make& make) {
  std::vector<Ray> rays(static_cast<std::size_t>(count));
  std::vector<Hit> hits(rays.size());
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    rays[k] = Ray{};
    rays[k].origin = position;
    rays[k].direction = make(k);
    rays[k].t_near = 0;
    rays[k].t_far = std::numeric_limits<float>::infinity();
  }
  scene.tracer().intersect(rays, hits);
  std::vector<Float3> open;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (hits[k].triangle == kNone) open.push_back(rays[k].direction);
  }
  return open;
}

/// The irradiance of the sky alone on a surface at `position`, by brute force.
double gather_sky(const SeenScene& scene, const Sky& sky, const Float3& position,
                  const Float3& normal) {
  constexpr int kRays = 1 << 14;
  const glm::dmat3 frame = frame_around(to_dvec3(normal));
  double sum = 0;
  for (const Float3& direction : open_directions(scene, position, kRays, [&](std::uint32_t k) {
         return to_float3(frame * square_to_cosine_hemisphere(r2_point(k, {0.3, 0.7})));
       })) {
    sum += sky_luminance(sky, direction)[0];
  }
  return kPi * sum / kRays;
}

/// The harmonics of the sky that is seen at `position`, by brute force.
std::array<double, kHarmonicCount> project_sky(const SeenScene& scene, const Sky& sky,
                                               const Float3& position) {
  constexpr int kRays = 1 << 16;
  std::array<double, kHarmonicCount> sum{};
  for (const Float3& direction : open_directions(scene, position, kRays, [](std::uint32_t k) {
         const glm::dvec2 s = r2_point(k, {0.2, 0.9});
         const double z = 2 * s.x - 1, r = std::sqrt(1 - z * z), phi = 2 * kPi * s.y;
         return to_float3(glm::dvec3(r * std::cos(phi), r * std::sin(phi), z));
       })) {
    const Harmonics y = spherical_harmonics(direction);
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k] += 4 * kPi / kRays * y[k] * sky_luminance(sky, direction)[0];
    }
  }
  return sum;
}

std::vector<Float3> normals_around() {
  std::vector<Float3> normals;
  for (const float x : {-1.0F, 0.0F, 1.0F}) {
    for (const float y : {-1.0F, 0.0F, 1.0F}) {
      for (const float z : {-1.0F, 0.0F, 1.0F}) {
        if (x == 0 && y == 0 && z == 0) continue;
        normals.push_back(to_float3(glm::normalize(glm::dvec3(x, y, z))));
      }
    }
  }
  return normals;
}

TEST(SeenLight, ProbesHoldTheHarmonicsOfTheSkyThatTheySee) {
  const SeenScene& scene = yard();
  const LightProbes probes = scene.probes_at({{0, 0.5F, 0}, {1.5F, 1, 0}, {-1.5F, 1.2F, 1}}, 4096);
  const Sky sky = sunset();
  std::vector<ProbeLight> light(probes.size());
  apply_probes(probes, std::vector<Float3>(scene.data.patches.size()), sky, light);
  double difference = 0, total = 0;
  for (std::size_t p = 0; p < probes.size(); ++p) {
    const auto truth = project_sky(scene, sky, probes.position[p]);
    for (std::size_t k = 0; k < kHarmonicCount; ++k) {
      difference += std::pow(light[p][k][0] - truth[k], 2);
      total += truth[k] * truth[k];
    }
  }
  std::printf("relative L2 error of the harmonics: %.4f\n", std::sqrt(difference / total));
  EXPECT_LE(std::sqrt(difference / total), 0.01);
}

/// Relative L2 errors of the irradiance of the sky alone at `probes`, over many normals.
struct SkyErrors {
  double found = 0, quadratic = 0;  // with and without degree 4
  double for_normals = 0;           // cell by cell
  double of_mean = 0;               // of the sky's mean
};

SkyErrors errors_of_sky(const SeenScene& scene, const LightProbes& probes, const Sky& sky) {
  const std::vector<Float3> dark(scene.data.patches.size());
  std::vector<ProbeLight> light(probes.size()), mean_light(probes.size());
  std::vector<QuadraticProbeLight> quadratic(probes.size());
  apply_probes(probes, dark, sky, light);
  apply_probes(probes, dark, sky, quadratic);
  LightProbes even = probes;
  even.sky_cells = {};
  apply_probes(even, dark, sky, mean_light);
  const std::vector<Float3> normals = normals_around();
  std::vector<Float3> irradiance(probes.size() * normals.size());
  irradiance_at_probes(probes, dark, sky, normals, irradiance);
  SkyErrors sum;
  double total = 0;
  for (std::size_t p = 0; p < probes.size(); ++p) {
    for (std::size_t k = 0; k < normals.size(); ++k) {
      const Float3& normal = normals[k];
      const double truth = gather_sky(scene, sky, probes.position[p], normal);
      sum.for_normals += std::pow(irradiance[p * normals.size() + k][0] - truth, 2);
      sum.found += std::pow(probe_irradiance(light[p], normal)[0] - truth, 2);
      sum.quadratic += std::pow(probe_irradiance(quadratic[p], normal)[0] - truth, 2);
      sum.of_mean += std::pow(probe_irradiance(mean_light[p], normal)[0] - truth, 2);
      total += truth * truth;
    }
  }
  return {.found = std::sqrt(sum.found / total),
          .quadratic = std::sqrt(sum.quadratic / total),
          .for_normals = std::sqrt(sum.for_normals / total),
          .of_mean = std::sqrt(sum.of_mean / total)};
}

TEST(SeenLight, ASunsetLightsProbesFromItsSide) {
  const SeenScene& scene = yard();
  const LightProbes probes = scene.probes_at({{0, 0.5F, 0}, {1.5F, 1, 0}, {-1.5F, 1.2F, 1}}, 4096);
  const Sky sky = sunset();
  const SkyErrors error = errors_of_sky(scene, probes, sky);
  std::printf(
      "relative L2 error of the irradiance: %.4f, %.4f to degree 2, %.4f for normals, "
      "%.4f of the mean\n",
      error.found, error.quadratic, error.for_normals, error.of_mean);
  EXPECT_LE(error.found, 0.02);
  EXPECT_LE(error.for_normals, 0.02);
  EXPECT_LE(error.quadratic, 0.025);  // what the series lacks beyond degree 2, not the rays
  EXPECT_GE(error.of_mean, 0.2);
  std::vector<ProbeLight> light(probes.size());
  apply_probes(probes, std::vector<Float3>(scene.data.patches.size()), sky, light);
  for (const ProbeLight& at_probe : light) {
    EXPECT_GT(probe_irradiance(at_probe, {1, 0, 0})[0],
              3 * probe_irradiance(at_probe, {-1, 0, 0})[0]);
  }
}

TEST(SeenLight, ProbesFollowOtherSkiesToo) {
  const SeenScene& scene = yard();
  const LightProbes probes = scene.probes_at({{0, 0.5F, 0}, {1.5F, 1, 0}, {-1.5F, 1.2F, 1}}, 4096);
  const Sky uniform{.color = {1, 0.8F, 0.5F}, .luminance = 1000};
  Sky noon = uniform, overcast = uniform;
  noon.distribution =
      std::make_shared<const SkyDistribution>(cie_sky(kCieClearSky, {-0.5F, -0.6F, -0.3F}, 0.2));
  overcast.distribution = std::make_shared<const SkyDistribution>(cie_sky(1, {0, -1, 0}, 0.2));
  for (const Sky& sky : {uniform, noon, overcast}) {
    const SkyErrors error = errors_of_sky(scene, probes, sky);
    std::printf("relative L2 error of the irradiance: %.4f, %.4f to degree 2, %.4f for normals\n",
                error.found, error.quadratic, error.for_normals);
    EXPECT_LE(error.found, 0.01);
    EXPECT_LE(error.for_normals, 0.02);
    EXPECT_LT(error.found, error.quadratic);
  }
}

TEST(SeenLight, AnEvenDistributionIsAUniformSky) {
  const SeenScene& scene = yard();
  const LightProbes probes = scene.probes_at({{0, 0.5F, 0}}, 1024);
  SkyDistribution even;
  even.fill(1);
  const Sky uniform{.color = {1, 2, 3}, .luminance = 5};
  Sky by_cells = uniform;
  by_cells.distribution = std::make_shared<const SkyDistribution>(even);
  const std::vector<Float3> dark(scene.data.patches.size());
  std::vector<ProbeLight> a(1), b(1);
  apply_probes(probes, dark, uniform, a);
  apply_probes(probes, dark, by_cells, b);
  for (std::size_t k = 0; k < a[0].size(); ++k) EXPECT_NEAR(a[0][k][1], b[0][k][1], 1e-4);
}

TEST(SeenLight, ASunsetBendsNormalsTowardsIt) {
  const SeenScene& scene = yard();
  const SurfaceHarmonics harmonics =
      trace_surface_harmonics(scene.data, scene.shown_patch, scene.tracer(), {.ray_count = 4096});
  const Sky sky = sunset();
  const std::vector<Float3> dark(scene.data.patches.size());
  std::vector<SurfaceLight> light(scene.data.patches.size());
  apply_surface_harmonics(harmonics, dark, sky, light);
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (scene.data.patches.normal[i][1] < 0.9F) continue;  // the floor
    const double east = surface_irradiance(light[i], {0.6F, 0.8F, 0})[0];
    const double west = surface_irradiance(light[i], {-0.6F, 0.8F, 0})[0];
    EXPECT_GT(east, 1.5 * west) << i;
  }
}

}  // namespace
}  // namespace rebounce::test_seen_light
