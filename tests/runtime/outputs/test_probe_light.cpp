#include "runtime/outputs/probe_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "rebounce/outputs.h"
#include "runtime/outputs/probe_irradiance.h"
#include "runtime/outputs/spherical_harmonics.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/expect_error.h"

namespace rebounce::test_probe_light {
namespace {

constexpr double kPi = std::numbers::pi;

/// Sums over a fine grid of the sphere: f(direction, solid angle).
template <typename Function>
void over_sphere(const Function& f) {
  constexpr int kRows = 200, kColumns = 400;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      const double z = -1 + (i + 0.5) * 2 / kRows, r = std::sqrt(1 - z * z);
      const double phi = 2 * kPi * (j + 0.5) / kColumns;
      f(Float3{static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
               static_cast<float>(z)},
        4 * kPi / (kRows * kColumns));
    }
  }
}

TEST(SphericalHarmonics, AreOrthonormal) {
  std::array<std::array<double, 18>, 18> product{};
  over_sphere([&](const Float3& d, double solid_angle) {
    const auto y = irradiance_harmonics(d);
    for (std::size_t a = 0; a < 18; ++a) {
      for (std::size_t b = 0; b < 18; ++b) product[a][b] += solid_angle * y[a] * y[b];
    }
  });
  for (std::size_t a = 0; a < 18; ++a) {
    for (std::size_t b = 0; b < 18; ++b) EXPECT_NEAR(product[a][b], a == b ? 1 : 0, 2e-3);
  }
}

float dot(const Float3& u, const Float3& v) {
  return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

TEST(SphericalHarmonics, TheCosineLobeHasTheirFactors) {
  const Float3 normal = {-0.48F, 0.6F, -0.64F};
  std::array<double, 18> lobe{};
  over_sphere([&](const Float3& d, double solid_angle) {
    const auto y = irradiance_harmonics(d);
    for (std::size_t k = 0; k < 18; ++k)
      lobe[k] += solid_angle * y[k] * std::max(0.0F, dot(d, normal));
  });
  const auto y = irradiance_harmonics(normal);
  for (std::size_t k = 0; k < 18; ++k) EXPECT_NEAR(lobe[k], kCosineLobe[k] * y[k], 1e-3) << k;
}

TEST(SphericalHarmonics, DegreeFourOfASpotFollowsFromItsDirectionAndSize) {
  const Float3 middle = {0.36F, 0.48F, 0.8F};
  // As wide as a cell of the sky, twice that, and a half sphere, which has no degree 4. The columns
  // of the grid make a spot that is not quite round.
  for (const double width : {0.1, 0.2, kPi / 2}) {
    Harmonics weight{}, truth{};
    over_sphere([&](const Float3& d, double solid_angle) {
      if (dot(d, middle) < std::cos(width)) return;
      const Harmonics y = spherical_harmonics(d), y_4 = degree_4_harmonics(d);
      for (std::size_t k = 0; k < 9; ++k) {
        weight[k] += static_cast<float>(solid_angle) * y[k];
        truth[k] += static_cast<float>(solid_angle) * y_4[k];
      }
    });
    const Harmonics found = degree_4_of_spot(weight);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(found[k], truth[k], 5e-3 * weight[0]) << width;
  }
  EXPECT_EQ(degree_4_of_spot(Harmonics{}), Harmonics{});
  EXPECT_EQ(degree_4_of_spot(Harmonics{1}), Harmonics{});
}

TEST(ProbeLight, UniformLightIsPiTimesLuminance) {
  ProbeLight light{};
  light[0] = {2 / 0.282095F, 0, 0};  // luminance 2: 2 / Y00 is 2 sqrt(4 pi)
  EXPECT_NEAR(probe_irradiance(light, {0, 1, 0})[0], 2 * kPi, 1e-5);
  EXPECT_NEAR(probe_irradiance(light, {0.6F, 0, -0.8F})[0], 2 * kPi, 1e-5);
}

TEST(ProbeLight, SmoothLightIsExact) {
  // L = 1 + d.a + (d.b)²: degree 2, for which the method is exact.
  const Float3 a = {0.2F, -0.1F, 0.3F}, b = {0.5F, 0.4F, -0.6F};
  ProbeLight light{};
  over_sphere([&](const Float3& d, double solid_angle) {
    const Harmonics y = spherical_harmonics(d);
    const double radiance = 1 + dot(d, a) + dot(d, b) * dot(d, b);
    for (std::size_t k = 0; k < 9; ++k)
      light[k][1] += static_cast<float>(solid_angle * radiance * y[k]);
  });
  for (const Float3& n : {Float3{0, 0, 1}, Float3{0.6F, 0.8F, 0}, Float3{-0.48F, 0.6F, -0.64F}}) {
    double truth = 0;
    over_sphere([&](const Float3& d, double solid_angle) {
      truth += solid_angle * std::max(0.0F, dot(d, n)) * (1 + dot(d, a) + dot(d, b) * dot(d, b));
    });
    EXPECT_NEAR(probe_irradiance(light, n)[1] / truth, 1, 1e-3);
  }
}

LightProbes row_of_three() {
  LightProbes probes;
  probes.position = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  probes.valid = {1, 1, 0};
  probes.sky = {Harmonics{1}, Harmonics{2}, Harmonics{}};
  probes.entry_begin = {0, 2, 3, 3};
  probes.entry_patch = {0, 1, 1};
  probes.entry_weight = {Harmonics{1, 2}, Harmonics{3}, Harmonics{0, 0, 5}};
  probes.grid = {3, 1, 1};
  probes.patch_count = 2;
  return probes;
}

TEST(ProbeLight, AppliesItsMap) {
  const LightProbes probes = row_of_three();
  const std::vector<Float3> radiosity = {{10, 0, 1}, {0, 20, 2}};
  std::vector<ProbeLight> light(3);
  const Sky sky{.color = {1, 0, 0}, .luminance = 100};
  const int count = test::count_allocations([&] { apply_probes(probes, radiosity, sky, light); });
  EXPECT_LE(count, 0);
  EXPECT_EQ(light[0][0], (Float3{110, 60, 7}));
  EXPECT_EQ(light[0][1], (Float3{20, 0, 2}));
  EXPECT_EQ(light[1][0], (Float3{200, 0, 0}));
  EXPECT_EQ(light[1][2], (Float3{0, 100, 10}));
  EXPECT_EQ(light[2], ProbeLight{});
  test::expect_error([&] { apply_probes(probes, radiosity, sky, std::span(light).first(2)); },
                     "must have 3");
  test::expect_error([&] { apply_probes(probes, std::span(radiosity).first(1), sky, light); },
                     "must have 2");
}

TEST(ProbeLight, DegreeFourIsThatOfTheSkyByItsCells) {
  LightProbes probes = row_of_three();
  const std::vector<Float3> radiosity = {{10, 0, 1}, {0, 20, 2}};
  std::vector<ProbeLight> light(3);
  const Sky sky{.color = {1, 0, 0.5F}, .luminance = 100};
  apply_probes(probes, radiosity, sky, light);
  for (std::size_t k = 9; k < 18; ++k) EXPECT_EQ(light[0][k], (Float3{0, 0, 0}));
  const Float3 direction = {0.36F, 0.48F, 0.8F};
  probes.sky_cells = {{0, 1, 1, 1}, {7}, {spherical_harmonics(direction)}};
  EXPECT_LE(test::count_allocations([&] { apply_probes(probes, radiosity, sky, light); }), 0);
  const Harmonics degree_4 = degree_4_harmonics(direction);
  for (std::size_t k = 0; k < 9; ++k) {
    EXPECT_NEAR(light[0][9 + k][0], 100 * degree_4[k], 0.01);
    EXPECT_NEAR(light[0][9 + k][2], 50 * degree_4[k], 0.01);
  }
  std::vector<QuadraticProbeLight> quadratic(3);
  apply_probes(probes, radiosity, sky, quadratic);
  EXPECT_TRUE(std::ranges::equal(quadratic[0], std::span(light[0]).first<9>()));
  EXPECT_EQ(probe_irradiance(quadratic[0], direction)[1], probe_irradiance(light[0], direction)[1]);
  EXPECT_LT(probe_irradiance(light[0], direction)[0], probe_irradiance(quadratic[0], direction)[0]);
}

TEST(ProbeLight, InterpolatesBetweenValidProbes) {
  const LightProbes probes = row_of_three();
  std::vector<ProbeLight> light(3);
  light[0][0] = {8, 0, 0};
  light[1][0] = {4, 0, 0};
  light[2][0] = {1000, 0, 0};
  const auto at = [&](float x) { return interpolate_probes(probes, light, {x, 7, -3})[0][0]; };
  EXPECT_FLOAT_EQ(at(0), 8);
  EXPECT_FLOAT_EQ(at(0.25F), 7);
  EXPECT_FLOAT_EQ(at(-9), 8);
  EXPECT_FLOAT_EQ(at(1.9F), 4);  // the third is not valid
  EXPECT_FLOAT_EQ(at(5), 0);
}

constexpr std::size_t kMapSize = 9;  // 81 normals: more than one block of them

std::vector<Float3> map_normals() {
  std::vector<Float3> normals(kMapSize * kMapSize);
  write_octahedral_normals(kMapSize, normals);
  return normals;
}

TEST(OctahedralMap, UnfoldsTheSphere) {
  const std::vector<Float3> normals = map_normals();
  EXPECT_EQ(normals[kMapSize * kMapSize / 2], (Float3{0, 0, 1}));
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const auto [x, y, z] = normals[k];
    EXPECT_NEAR(x * x + y * y + z * z, 1, 1e-6);
    // Back to the octahedron, and its lower half unfolded.
    const float sum = std::abs(x) + std::abs(y) + std::abs(z);
    float u = x / sum, v = y / sum;
    if (z < 0) {
      const float inner = u;
      u = std::copysign(1 - std::abs(v), u);
      v = std::copysign(1 - std::abs(inner), v);
    }
    const auto row = k / kMapSize, column = k % kMapSize;
    EXPECT_NEAR(u, (2 * static_cast<float>(column) + 1) / kMapSize - 1, 1e-6);
    EXPECT_NEAR(v, (2 * static_cast<float>(row) + 1) / kMapSize - 1, 1e-6);
  }
}

/// One probe that sees one patch: what lies within `half_angle` of `middle`.
LightProbes probe_before_a_cap(const Float3& middle, double half_angle) {
  LightProbes probes;
  probes.position = {{0, 0, 0}};
  probes.valid = {1};
  probes.sky = {Harmonics{}};
  probes.entry_begin = {0, 1};
  probes.entry_patch = {0};
  probes.entry_weight = {Harmonics{}};
  probes.patch_count = 1;
  over_sphere([&](const Float3& d, double solid_angle) {
    if (dot(d, middle) < std::cos(half_angle)) return;
    const Harmonics y = spherical_harmonics(d);
    for (std::size_t k = 0; k < y.size(); ++k) {
      probes.entry_weight[0][k] += static_cast<float>(solid_angle * y[k]);
    }
  });
  return probes;
}

TEST(ProbeIrradiance, OfCapsOfTheSphereIsThatOfASum) {
  const Float3 middle = {0.36F, 0.48F, 0.8F};
  const std::vector<Float3> normals = map_normals(), radiosity = {{1, 2, 0}};
  std::vector<Float3> irradiance(normals.size());
  for (const double half_angle : {0.1, 0.3, 0.6, 1.2, kPi}) {
    irradiance_at_probes(probe_before_a_cap(middle, half_angle), radiosity, {}, normals,
                         irradiance);
    double difference = 0, total = 0;
    for (std::size_t k = 0; k < normals.size(); ++k) {
      double truth = 0;
      over_sphere([&](const Float3& d, double solid_angle) {
        if (dot(d, middle) < std::cos(half_angle)) return;
        truth += solid_angle * std::max(0.0F, dot(d, normals[k]));
      });
      difference += std::pow(irradiance[k][0] - truth, 2);
      total += truth * truth;
      EXPECT_FLOAT_EQ(irradiance[k][1], 2 * irradiance[k][0]);
      EXPECT_EQ(irradiance[k][2], 0);
    }
    const double error = std::sqrt(difference / total);
    std::printf("cap of %.1f rad: relative L2 error of the irradiance %.4f\n", half_angle, error);
    EXPECT_LE(error, 0.02);
  }
}

TEST(ProbeIrradiance, OfTheSkyGoesByItsCells) {
  LightProbes probes = row_of_three();
  const Float3 up = {0, 1, 0}, aside = {1, 0, 0};
  const std::vector<Float3> radiosity(2), normals = {up, aside};
  std::vector<Float3> irradiance(6);
  const Sky sky{.color = {1, 0, 0.5F}, .luminance = 100};
  probes.sky_cells = {{0, 1, 1, 1}, {145}, {spherical_harmonics(up)}};
  irradiance_at_probes(probes, radiosity, sky, normals, irradiance);
  EXPECT_NEAR(irradiance[0][0], 100, 1e-3);  // a point of 1 sr right above
  EXPECT_NEAR(irradiance[0][2], 50, 1e-3);
  EXPECT_NEAR(irradiance[1][0], 0, 0.1);
  EXPECT_EQ(irradiance[2], (Float3{0, 0, 0}));  // the second probe sees none
  probes.sky_cells = {};
  irradiance_at_probes(probes, radiosity, sky, normals, irradiance);
  EXPECT_NEAR(irradiance[0][0], 100 * kPi * 0.282095, 0.01);  // its mean, of degree 0 alone
}

TEST(ProbeIrradiance, NeedsRightSizesAndNoMemory) {
  LightProbes probes = row_of_three();
  probes.entry_weight[2] = {3, 0, 1};  // nowhere negative
  const std::vector<Float3> radiosity = {{10, 0, 1}, {0, 20, 2}}, normals = map_normals();
  std::vector<Float3> irradiance(3 * normals.size()), in_air(normals.size());
  const int count = test::count_allocations([&] {
    irradiance_at_probes(probes, radiosity, {}, normals, irradiance);
    irradiance_in_air(probes, radiosity, {}, {0.5F, 0, 0}, normals, in_air);
  });
  EXPECT_LE(count, 0);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Float3 &a = irradiance[k], &b = irradiance[normals.size() + k];
    EXPECT_NEAR(in_air[k][0], 0.5F * (a[0] + b[0]), 1e-4);
    EXPECT_NEAR(in_air[k][1], 0.5F * (a[1] + b[1]), 1e-4);
    EXPECT_EQ(irradiance[2 * normals.size() + k], (Float3{0, 0, 0}));  // not valid
  }
  irradiance_in_air(probes, radiosity, {}, {2, 0, 0}, normals, in_air);
  EXPECT_EQ(in_air.front(), (Float3{0, 0, 0}));
  test::expect_error(
      [&] { irradiance_at_probes(probes, radiosity, {}, normals, std::span(irradiance).first(5)); },
      "must have 243");
  test::expect_error(
      [&] {
        irradiance_in_air(probes, std::span(radiosity).first(1), {}, {0, 0, 0}, normals, in_air);
      },
      "must have 2");
}

}  // namespace
}  // namespace rebounce::test_probe_light
