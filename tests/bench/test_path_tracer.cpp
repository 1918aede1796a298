#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <numbers>
#include <vector>

#include "bench/reference/path_tracer.h"
#include "bench/reference/scene_surface.h"
#include "precompute/patches/lit_sides.h"
#include "precompute/patches/texture_sampling.h"
#include "rebounce/error.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"

namespace rebounce::reference::test_path_tracer {
namespace {

using test::add_box;
using test::add_polygon;
using test::empty_scene;

constexpr double kPi = std::numbers::pi;

IrradianceEstimate measure(const Scene& scene, std::span<const SurfacePoint> points,
                           std::uint32_t samples, std::vector<Light> lights = {}, Sky sky = {},
                           std::uint64_t seed = 1) {
  const RayTracer tracer = make_scene_tracer(scene);
  return indirect_irradiance({scene, tracer, lights, std::move(sky)}, points, samples, seed);
}

std::vector<SurfacePoint> points_on(const Scene& scene, std::size_t count) {
  return sample_surface(scene, find_lit_sides(scene, make_scene_tracer(scene)), count, 7);
}

/// The luminance that makes an exitance of 1 lx.
const float kUnitLuminance = static_cast<float>(1 / kPi);

void set_luminance(Material& material, float luminance) {
  material.emitted_luminance = {luminance, luminance, luminance};
}

std::uint32_t add_material(Scene& scene, float reflectance, float exitance) {
  Material material;
  material.base_color = {reflectance, reflectance, reflectance};
  set_luminance(material, exitance * kUnitLuminance);
  scene.materials.push_back(material);
  return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

/// An upright or lying square of half side `half` around `centre`, seen from where z is larger.
void add_square(Scene& scene, const glm::dvec3& centre, double half, bool faces_up,
                std::uint32_t material) {
  const glm::dvec3 x(half, 0, 0), y(0, half, 0);
  std::array<glm::dvec3, 4> corner{centre - x - y, centre + x - y, centre + x + y, centre - x + y};
  if (!faces_up) std::swap(corner[1], corner[3]);
  add_polygon(scene, corner, material);
}

SurfacePoint point_at(const Float3& position, const Float3& normal) {
  return {.position = position, .normal = normal};
}

/// Mean over the points and its standard error, first channel.
struct Overall {
  double mean = 0, standard_error = 0;
};

Overall over_all_points(const IrradianceEstimate& estimate) {
  Overall overall;
  const auto n = static_cast<double>(estimate.mean.size());
  for (std::size_t k = 0; k < estimate.mean.size(); ++k) {
    overall.mean += estimate.mean[k][0] / n;
    overall.standard_error += std::pow(estimate.standard_error[k][0] / n, 2);
  }
  overall.standard_error = std::sqrt(overall.standard_error);
  return overall;
}

// Four deviations: chance alone goes beyond in one of 10,000, and the seeds are fixed.
constexpr double kDeviations = 4;

// Room for rays that slip by a corner, and for single precision.
constexpr double kRounding = 2e-5;

void expect_mean(const IrradianceEstimate& estimate, double expected, double largest_noise) {
  const Overall measured = over_all_points(estimate);
  EXPECT_NEAR(measured.mean, expected,
              kDeviations * measured.standard_error + kRounding * expected);
  EXPECT_LT(measured.standard_error, largest_noise * expected);
}

class Furnace : public testing::TestWithParam<float> {};

TEST_P(Furnace, IndirectIrradianceIsTheRadiosityEverywhere) {
  const float rho = GetParam();
  Scene scene = empty_scene({rho, rho, rho});
  set_luminance(scene.materials[0], kUnitLuminance);
  add_box(scene, {0, 0, 0}, {3, 2, 1}, true);
  const IrradianceEstimate estimate = measure(scene, points_on(scene, 64), 256);
  const double radiosity = 1 / (1 - static_cast<double>(rho));
  expect_mean(estimate, radiosity, 0.01);
  for (std::size_t k = 0; k < estimate.mean.size(); ++k) {
    // Seven degrees of freedom: eight estimated deviations are about four true ones.
    EXPECT_NEAR(estimate.mean[k][1], radiosity, 8 * estimate.standard_error[k][1] + 1e-4);
    EXPECT_EQ(estimate.absorbed[k], 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Reflectances, Furnace, testing::Values(0.1F, 0.5F, 0.9F));

/// The inside of a sphere of radius 1 from longitudes and latitudes.
Scene make_ball(const Float3& reflectance) {
  constexpr int kLatitudes = 24, kLongitudes = 48;
  const auto at = [](int i, int j) {
    const double theta = kPi * i / kLatitudes, phi = 2 * kPi * j / kLongitudes;
    return glm::dvec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                      std::cos(theta));
  };
  Scene scene = empty_scene(reflectance);
  for (int i = 0; i < kLatitudes; ++i) {
    for (int j = 0; j < kLongitudes; ++j) {
      std::vector<glm::dvec3> corner{at(i, j), at(i, (j + 1) % kLongitudes)};
      if (i + 1 < kLatitudes) corner.push_back(at(i + 1, (j + 1) % kLongitudes));
      if (i + 1 < kLatitudes) corner.push_back(at(i + 1, j));
      if (i + 1 == kLatitudes) corner.push_back(at(i + 1, 0));
      if (i == 0) corner.erase(corner.begin() + 1);
      add_polygon(scene, corner);
    }
  }
  return scene;
}

double surface_area(const Scene& scene) {
  double area = 0;
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    area += area_of(SceneSurface(scene).corners(t));
  }
  return area;
}

Light point_lamp(const Float3& position, double flux) {
  Light lamp;
  lamp.position = position;
  lamp.intensity = static_cast<float>(flux / (4 * kPi));
  return lamp;
}

TEST(IntegratingSphere, IndirectIrradianceIsUniform) {
  // rho / (1 - rho) Phi / (4 pi R²) for Phi = 1 lm, R = 1 m, wherever the lamp is.
  for (const auto& [rho, expected] : {std::pair{0.5F, 0.0795774715459}, {0.9F, 0.716197243914}}) {
    const Scene scene = make_ball({rho, rho, rho});
    const std::vector<Light> lamps{point_lamp({0.3F, 0, 0.2F}, 1)};
    const IrradianceEstimate estimate = measure(scene, points_on(scene, 200), 128, lamps);
    // All light is absorbed in the end, so the mean over the flat triangles is exact.
    expect_mean(estimate, expected * 4 * kPi / surface_area(scene), 0.01);
    EXPECT_NEAR(over_all_points(estimate).mean, expected, 0.02 * expected);
  }
}

TEST(IntegratingSphere, LampsAddUp) {
  const Scene scene = make_ball({0.5F, 0.5F, 0.5F});
  std::vector<Light> lamps{point_lamp({0.3F, 0, 0.2F}, 1), point_lamp({0, -0.5F, 0}, 4),
                           point_lamp({-0.1F, 0.4F, 0}, 0.2)};
  lamps.push_back(point_lamp({0.1F, 0.1F, 0}, 0));  // off
  const IrradianceEstimate estimate = measure(scene, points_on(scene, 200), 128, lamps);
  expect_mean(estimate, 5.2 / surface_area(scene), 0.005);
}

/// View factor from an element to a rectangle a x b parallel to it, 1 m away, with a corner
/// straight above it (Howell's catalogue, B-3).
double corner_view_factor(double a, double b) {
  const double u = std::sqrt(1 + a * a), v = std::sqrt(1 + b * b);
  return (a / u * std::atan(b / u) + b / v * std::atan(a / v)) / (2 * kPi);
}

TEST(ElementToRectangle, ViewFactorOfAnEmitter) {
  Scene scene = empty_scene({0, 0, 0});
  const std::uint32_t emitter = add_material(scene, 0, 1);
  add_square(scene, {0.5, 0.5, 1}, 0.5, false, emitter);
  const std::vector points{point_at({0, 0, 0}, {0, 0, 1})};
  const IrradianceEstimate estimate = measure(scene, points, 8192);
  constexpr double kViewFactor = 0.13853160599489;
  EXPECT_NEAR(corner_view_factor(1, 1), kViewFactor, 1e-12);
  expect_mean(estimate, kViewFactor, 0.005);
}

TEST(ElementToRectangle, SmallBrightEmittersAreFound) {
  // A part in 30,000 of the hemisphere: without looking for it, next to no path would meet it.
  Scene scene = empty_scene({0, 0, 0});
  const std::uint32_t emitter = add_material(scene, 0, 1e4F);
  add_square(scene, {0.005, 0.005, 1}, 0.005, false, emitter);
  const std::vector points{point_at({0, 0, 0}, {0, 0, 1})};
  expect_mean(measure(scene, points, 512), 1e4 * corner_view_factor(0.01, 0.01), 0.005);
}

TEST(ParallelPlates, ExchangeLightForEver) {
  // B1 = (M1 + rho1 M2) / (1 - rho1 rho2), and each receives what the other sends.
  struct Plates {
    float reflectance_1, reflectance_2, exitance_1, exitance_2;
    double radiosity_1, radiosity_2;
  };
  for (const Plates& plates : {Plates{0.5F, 0.8F, 1, 0, 1.66666666667, 1.33333333333},
                               Plates{0.3F, 0.3F, 1, 2, 1.75824175824, 2.52747252747},
                               Plates{0.9F, 0.1F, 0, 1, 0.989010989011, 1.0989010989}}) {
    Scene scene = empty_scene();
    const std::uint32_t lower = add_material(scene, plates.reflectance_1, plates.exitance_1);
    const std::uint32_t upper = add_material(scene, plates.reflectance_2, plates.exitance_2);
    // So wide that a part in a million of the light escapes from between them.
    add_square(scene, {0, 0, 0}, 1000, true, lower);
    add_square(scene, {0, 0, 1}, 1000, false, upper);
    const std::vector at_lower{point_at({0.1F, 0.2F, 0}, {0, 0, 1})};
    const std::vector at_upper{point_at({0.1F, 0.2F, 1}, {0, 0, -1})};
    expect_mean(measure(scene, at_lower, 8192), plates.radiosity_2, 0.01);
    expect_mean(measure(scene, at_upper, 8192), plates.radiosity_1, 0.01);
  }
}

TEST(Sky, IsIndirectOnlyOnceReflected) {
  Scene scene = empty_scene({0.5F, 0.25F, 0.125F});
  add_square(scene, {0, 0, 0}, 1000, true, 0);
  const Sky sky{{1, 0.5F, 2}, kUnitLuminance};
  const std::vector points{point_at({0, 0, 1}, {0, 0, -1}), point_at({0, 0, 1}, {0, 0, 1})};
  const IrradianceEstimate estimate = measure(scene, points, 1024, {}, sky);
  EXPECT_NEAR(estimate.mean[0][0], 0.5, 1e-4);
  EXPECT_NEAR(estimate.mean[0][1], 0.125, 1e-4);
  EXPECT_NEAR(estimate.mean[0][2], 0.25, 1e-4);
  EXPECT_EQ(estimate.mean[1], (Float3{0, 0, 0}));
}

TEST(TwoSides, OneSidedSurfacesAbsorbFromBehind) {
  Scene scene = empty_scene({0.5F, 0.5F, 0.5F});
  set_luminance(scene.materials[0], kUnitLuminance);
  add_square(scene, {0.5, 0.5, 1}, 0.5, true, 0);  // its back looks down at the point
  const std::vector points{point_at({0, 0, 0}, {0, 0, 1})};
  const std::vector<Light> lamps{point_lamp({0, 0, 0.5F}, 100)};  // between them
  const IrradianceEstimate estimate = measure(scene, points, 8192, lamps);
  EXPECT_EQ(estimate.mean[0], (Float3{0, 0, 0}));
  EXPECT_NEAR(estimate.absorbed[0], 0.13853160599489, 0.005);
}

TEST(TwoSides, DoubleSidedSurfacesEmitAndReflectOnBoth) {
  for (const bool faces_up : {true, false}) {
    Scene scene = empty_scene({0.4F, 0.4F, 0.4F});
    scene.materials[0].double_sided = true;
    set_luminance(scene.materials[0], kUnitLuminance);
    add_square(scene, {0.5, 0.5, 1}, 0.5, faces_up, 0);
    // Slanting, so that the way of the light does not go through the point's own place.
    Light sun;
    sun.type = LightType::kDirectional;
    sun.direction = {0, 0.6F, 0.8F};
    sun.intensity = 10;
    const std::vector points{point_at({0, 0, 0}, {0, 0, 1})};
    const IrradianceEstimate estimate = measure(scene, points, 8192, {sun});
    expect_mean(estimate, 0.13853160599489 * (1 + 0.4 * 10 * 0.8), 0.01);
    EXPECT_EQ(estimate.absorbed[0], 0);
  }
}

/// A checker of dark and bright squares of 8 x 8 texels, two of each.
Image make_checker(std::uint8_t dark, std::uint8_t bright) {
  Image image{.width = 16, .height = 16, .rgba = {}};
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 16; ++column) {
      const std::uint8_t value = (row / 8 + column / 8) % 2 == 0 ? dark : bright;
      image.rgba.insert(image.rgba.end(), {value, value, value, 255});
    }
  }
  return image;
}

/// A square floor of half side `half` under a checker that repeats every metre.
Scene make_checkered_floor(float half, std::uint8_t dark, std::uint8_t bright) {
  Scene scene = empty_scene({1, 1, 1});
  scene.textures.emplace_back();
  scene.images.push_back(make_checker(dark, bright));
  scene.materials[0].base_color_texture = 0;
  add_square(scene, {0, 0, 0}, half, true, 0);
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    scene.base_color_texcoord[v] = {scene.position[v][0], scene.position[v][1]};
  }
  return scene;
}

Light slanting_sun() {
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = {0.6F, 0, -0.8F};
  sun.intensity = 1;
  return sun;
}

TEST(Texture, EveryTexelReflectsByItself) {
  const Scene scene = make_checkered_floor(100, 0, 188);
  // A point over a dark square, and one high above all.
  const std::vector points{point_at({0.25F, 0.25F, 0.01F}, {0, 0, -1}),
                           point_at({0.25F, 0.25F, 20}, {0, 0, -1})};
  const IrradianceEstimate estimate = measure(scene, points, 8192, {slanting_sun()});
  EXPECT_LT(estimate.mean[0][0], 0.01);
  const double mean_reflectance = 0.5 * srgb_to_linear(188);
  const double view_factor =
      4 * corner_view_factor(5, 5);  // 100 m at 20 m, the shift is negligible
  EXPECT_NEAR(estimate.mean[1][0], 0.8 * mean_reflectance * view_factor,
              8 * estimate.standard_error[1][0]);
  EXPECT_LT(estimate.standard_error[1][0], 0.01 * estimate.mean[1][0]);
}

TEST(Texture, WhiteIsClamped) {
  const Scene scene = make_checkered_floor(1000, 255, 255);
  const std::vector points{point_at({0, 0, 1}, {0, 0, -1})};
  const IrradianceEstimate estimate = measure(scene, points, 512, {slanting_sun()});
  EXPECT_NEAR(estimate.mean[0][0], 0.8 * kMaxReflectance, 1e-4);
}

/// A room with a box in it, a lamp in a corner and a small emitter.
struct Room {
  Scene scene = empty_scene({0.7F, 0.5F, 0.3F});
  std::vector<Light> lamps{point_lamp({0.4F, 0.5F, 1.6F}, 30)};
  std::vector<SurfacePoint> points;

  Room() {
    const std::uint32_t emitter = add_material(scene, 0.2F, 20);
    add_box(scene, {0, 0, 0}, {3, 2, 2}, true);
    add_box(scene, {1, 0.5, 0}, {1.8, 1.2, 0.9}, false);
    add_square(scene, {2.2, 1, 1.99}, 0.2, false, emitter);
    points = points_on(scene, 300);
  }
};

double rms(std::span<const Float3> values) {
  double sum = 0;
  for (const Float3& v : values) sum += v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(Noise, FallsWithTheRootOfTheSamples) {
  const Room room;
  const double few = rms(measure(room.scene, room.points, 32, room.lamps).standard_error);
  const double many = rms(measure(room.scene, room.points, 512, room.lamps).standard_error);
  // Sixteen times the samples: a quarter of the noise, and less where stratification bites.
  EXPECT_GT(few / many, 3.5);
  EXPECT_LT(few / many, 8);
}

TEST(Noise, StandardErrorIsHonest) {
  const Room room;
  const IrradianceEstimate truth = measure(room.scene, room.points, 4096, room.lamps, {}, 5);
  const IrradianceEstimate estimate = measure(room.scene, room.points, 64, room.lamps, {}, 6);
  std::vector<Float3> difference(room.points.size());
  for (std::size_t k = 0; k < difference.size(); ++k) {
    for (std::size_t c = 0; c < kChannelCount; ++c) {
      difference[k][c] = estimate.mean[k][c] - truth.mean[k][c];
    }
  }
  const double expected = std::hypot(rms(estimate.standard_error), rms(truth.standard_error));
  // 300 points, their channels nearly alike: some 5 %.
  EXPECT_NEAR(rms(difference), expected, 0.2 * expected);
}

void expect_same_bits(const IrradianceEstimate& a, const IrradianceEstimate& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
  };
  EXPECT_TRUE(same(a.mean, b.mean));
  EXPECT_TRUE(same(a.standard_error, b.standard_error));
  EXPECT_TRUE(same(a.absorbed, b.absorbed));
}

TEST(Determinism, SameBitsForAnyNumberOfThreads) {
  const Room room;
  const auto make = [&] { return measure(room.scene, room.points, 64, room.lamps); };
  const IrradianceEstimate one = test::with_threads(1, make), two = test::with_threads(2, make);
  expect_same_bits(one, two);
  const IrradianceEstimate other = measure(room.scene, room.points, 64, room.lamps, {}, 2);
  EXPECT_NE(one.mean, other.mean);
}

TEST(Arguments, AreChecked) {
  const Room room;
  EXPECT_THROW(measure(room.scene, room.points, 0), Error);
  EXPECT_TRUE(measure(room.scene, {}, 8).mean.empty());
  EXPECT_THROW(sample_surface(empty_scene(), {}, 1, 1), Error);
  EXPECT_THROW(sample_surface(room.scene, {}, 1, 1), Error);
  const RayTracer tracer = make_scene_tracer(room.scene);
  EXPECT_THROW(indirect_irradiance({room.scene, tracer, room.lamps, {}}, room.points, 8, 1,
                                   [](double) { return false; }),
               Cancelled);
}

TEST(SampleSurface, IsUniformByAreaOverLitSides) {
  Scene scene = empty_scene();
  scene.materials[0].double_sided = true;
  add_square(scene, {0, 0, 0}, 1, true, 0);
  add_square(scene, {0, 0, 1}, 0.5, true, 0);
  const TriangleSides both{SideKind::kLit, SideKind::kLit};
  const TriangleSides only_back{SideKind::kCovered, SideKind::kLit};
  const std::vector sides{both, both, only_back, only_back};
  const auto points = sample_surface(scene, sides, 900, 3);
  // Two sides of 4 m² and one of 1 m²: strata make the shares exact but for their borders.
  std::array<int, 3> count{};
  glm::dvec3 centroid(0);
  for (const SurfacePoint& p : points) {
    const bool is_small = p.position[2] > 0.5F;
    EXPECT_EQ(std::abs(p.normal[2]), 1);
    ++count[is_small ? 2 : p.normal[2] > 0 ? 0 : 1];
    EXPECT_TRUE(!is_small || p.normal[2] < 0);
    centroid += to_dvec3(p.position) / 900.0;
    const glm::dvec3 again = rebounce::point_at(SceneSurface(scene).corners(p.triangle),
                                                {p.barycentric[0], p.barycentric[1]});
    EXPECT_LT(glm::distance(again, to_dvec3(p.position)), 1e-6);
  }
  EXPECT_NEAR(count[0], 400, 4);
  EXPECT_NEAR(count[1], 400, 4);
  EXPECT_NEAR(count[2], 100, 4);
  EXPECT_NEAR(centroid.x, 0, 0.08);  // four deviations of 0.58 / sqrt(900)
  EXPECT_NEAR(centroid.y, 0, 0.08);
}

}  // namespace
}  // namespace rebounce::reference::test_path_tracer
