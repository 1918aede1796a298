#include "runtime/lights/sky_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/exchange/pairs/form_factors.h"
#include "rebounce/sky.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/polygon_form_factor.h"
#include "runtime/rays/sampling.h"
#include "tests/support/expect_error.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_sky_light {
namespace {

constexpr double kPi = std::numbers::pi;

/// What direct light needs of a scene.
struct OpenScene {
  TransferData data;

  OpenScene(Scene scene, std::size_t patch_count) {
    PatchModel model = make_patch_model(std::move(scene), {.patch_count = patch_count});
    FormFactors factors = compute_form_factors(model, test::make_tracer(model));
    data = test::data_of(std::move(model), std::move(factors));
  }

  std::vector<Float3> irradiance(const Sky& sky) const {
    const RayTracer tracer = make_surface_tracer(data.mesh);
    std::vector<Float3> direct(data.patches.size());
    DirectLighting(data, tracer).compute({}, sky, direct);
    return direct;
  }
};

/// The inside of a box of 2 x 1 x 2 m without a lid, its floor at height 0.
const OpenScene& open_box() {
  static const OpenScene box = [] {
    Scene scene = test::empty_scene();
    test::add_box(scene, {-1, 0, -1}, {1, 1, 1}, true);
    test::remove_face(scene, test::Face::kHighY);
    return OpenScene(std::move(scene), 400);
  }();
  return box;
}

Sky sky_of(const SkyDistribution& distribution) {
  return {.luminance = 1, .distribution = std::make_shared<const SkyDistribution>(distribution)};
}

TEST(SkyCells, AreTregenzas) {
  double sphere = 0;
  for (std::uint32_t cell = 0; cell < kSkyCellCount; ++cell) sphere += sky_cell_solid_angle(cell);
  EXPECT_NEAR(sphere, 4 * kPi, 1e-5);
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    for (std::uint32_t k = 0; k < 50; ++k) {
      const glm::dvec2 s = 0.001 + 0.998 * r2_point(k, {0.1, 0.2});
      const Float3 d = point_of_sky_cell(cell, {static_cast<float>(s.x), static_cast<float>(s.y)});
      ASSERT_EQ(sky_cell(d), cell) << d[0] << " " << d[1] << " " << d[2];
    }
  }
  const auto at = [](double altitude, double azimuth) {
    const double a = altitude * kPi / 180, z = azimuth * kPi / 180;
    return sky_cell({static_cast<float>(std::cos(a) * std::sin(z)), static_cast<float>(std::sin(a)),
                     static_cast<float>(-std::cos(a) * std::cos(z))});
  };
  EXPECT_EQ(at(-1, 0), 0U);
  EXPECT_EQ(at(6, 0), 1U);
  EXPECT_EQ(at(6, -5), 1U);
  EXPECT_EQ(at(6, -7), 30U);
  EXPECT_EQ(at(6, 84), 8U);  // towards the east
  EXPECT_EQ(at(18, 0), 31U);
  EXPECT_EQ(at(80, 0), 139U);
  EXPECT_EQ(at(85, 200), 145U);
  EXPECT_EQ(at(90, 0), 145U);
}

TEST(SkyLight, CellsAddUpToTheVisibilityOfAUniformSky) {
  const OpenScene& box = open_box();
  SkyDistribution even;
  even.fill(1);
  const std::vector<Float3> uniform = box.irradiance({.color = {1, 2, 3}, .luminance = 5});
  const std::vector<Float3> by_cells = box.irradiance(sky_of(even));
  double largest = 0;
  for (std::size_t i = 0; i < uniform.size(); ++i) {
    const float seen = box.data.patches.sky_visibility[i];
    EXPECT_FLOAT_EQ(uniform[i][1], 10 * static_cast<float>(kPi) * seen);
    EXPECT_NEAR(by_cells[i][0], kPi * seen, 1e-5);
    largest = std::max(largest, static_cast<double>(seen));
  }
  EXPECT_GT(largest, 0.5);
}

/// The fraction of the view of a floor point through the part of the opening in [low, 1] along x.
double part_of_opening(const Float3& p, float low) {
  const std::array<glm::vec3, 4> corner = {
      {{low, 1, -1}, {1, 1, -1}, {1, 1, 1}, {low, 1, 1}}};  // counter-clockwise from below
  return point_to_polygon_form_factor(to_glm(p), glm::vec3(0, 1, 0), corner);
}

TEST(SkyLight, HalfASkyOverAnOpenBoxIsItsClosedForm) {
  // Bright where x > 0; cells that lie on either side of that plane are half bright.
  SkyDistribution half{};
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    const float x = point_of_sky_cell(cell, {0.5F, 0.5F})[0];
    half[cell] = std::abs(x) < 1e-5F ? 0.5F : x > 0 ? 1.0F : 0.0F;
  }
  const OpenScene& box = open_box();
  const std::vector<Float3> found = box.irradiance(sky_of(half));
  double difference = 0, total = 0, bias = 0;
  int floor = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (box.data.patches.normal[i][1] < 0.9F) continue;
    ++floor;
    const Float3& p = box.data.patches.centroid[i];
    const double truth = kPi * part_of_opening(p, p[0]), error = found[i][0] - truth;
    difference += error * error;
    bias += error;
    total += truth * truth;
  }
  ASSERT_GT(floor, 80);
  const double error = std::sqrt(difference / total);
  std::printf("%d floor patches: relative L2 error %.4f, bias %.4f\n", floor, error,
              bias / std::sqrt(total * floor));
  // 4,096 rays a patch, of which some 1,000 pass that half of the opening.
  EXPECT_LE(error, 0.03);
  EXPECT_LE(std::abs(bias / std::sqrt(total * floor)), 0.005);
}

TEST(SkyLight, AWallSeesHalfSkyAndHalfGround) {
  Scene scene = test::empty_scene();
  const std::array<glm::dvec3, 4> wall = {{{-1, 5, 0}, {1, 5, 0}, {1, 7, 0}, {-1, 7, 0}}};
  test::add_polygon(scene, wall);
  const OpenScene open(std::move(scene), 8);
  SkyDistribution above;
  above.fill(1);
  above[0] = 0;
  for (const Float3& e : open.irradiance(sky_of(above))) EXPECT_NEAR(e[0], kPi / 2, 0.01);
  SkyDistribution ground{};
  ground[0] = 2;
  for (const Float3& e : open.irradiance(sky_of(ground))) EXPECT_NEAR(e[0], kPi, 0.02);
}

TEST(SkyLight, IsRefusedWhereItCannotBeKnown) {
  OpenScene blind = open_box();
  blind.data.sky_cells = {};
  test::expect_error(
      [&] {
        blind.irradiance(sky_of(cie_sky(kCieOvercastSky, {0, -1, 0})));
      },
      "precompute the scene again");
  SkyDistribution negative{};
  negative[7] = -1;
  test::expect_error([&] { open_box().irradiance(sky_of(negative)); }, "at least 0");
  test::expect_error([&] { open_box().irradiance({.luminance = NAN}); }, "at least 0");
}

/// Horizontal irradiance of a sky whose zenith has luminance 1, from its cells.
double horizontal_irradiance(const SkyDistribution& sky) {
  double sum = 0;
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    sum += sky[cell] * sky_cell_solid_angle(cell) * point_of_sky_cell(cell, {0.5F, 0.5F})[1];
  }
  return sum;
}

TEST(CieSky, OvercastIsThatOfMoonAndSpencer) {
  const SkyDistribution sky = cie_sky(kCieOvercastSky, {1, 0, 0});
  EXPECT_NEAR(sky[145], 1, 0.01);
  // (1 + 2 sin(altitude)) / 3, which the standard's type 1 exceeds by up to 0.06 at middle heights.
  EXPECT_NEAR(horizontal_irradiance(sky), 7 * kPi / 9, 0.03 * 7 * kPi / 9);
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    const float y = point_of_sky_cell(cell, {0.5F, 0.5F})[1];
    EXPECT_NEAR(sky[cell], (1 + 2 * y) / 3, 0.065);
  }
  EXPECT_NEAR(sky[0], 0.2 * horizontal_irradiance(sky) / kPi, 1e-3);
}

TEST(CieSky, UniformIsUniform) {
  const SkyDistribution sky = cie_sky(5, {0, -1, 0}, 0.5F);
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) EXPECT_FLOAT_EQ(sky[cell], 1);
  EXPECT_NEAR(sky[0], 0.5, 1e-4);
}

TEST(CieSky, ClearIsBrightestAroundTheSun) {
  const Float3 sun = {-0.6F, -0.64F, 0.48F};  // from the north-east, 40 degrees high
  const SkyDistribution sky = cie_sky(kCieClearSky, sun);
  std::uint32_t brightest = 1;
  for (std::uint32_t cell = 1; cell < kSkyCellCount; ++cell) {
    if (sky[cell] > sky[brightest]) brightest = cell;
  }
  EXPECT_EQ(brightest, sky_cell({0.6F, 0.64F, -0.48F}));
  // Darkest opposite of it, at about a right angle.
  const Float3 away = {-0.5121F, 0.7682F, 0.3841F};
  EXPECT_LT(sky[sky_cell(away)], 0.12F * sky[brightest]);
}

TEST(CieSky, RefusesWhatThereIsNot) {
  test::expect_error([] { cie_sky(0, {0, -1, 0}); }, "ask for 1 to 15");
  test::expect_error([] { cie_sky(16, {0, -1, 0}); }, "ask for 1 to 15");
  test::expect_error([] { cie_sky(12, {0, 1, 0}); }, "above the horizon");
  test::expect_error([] { cie_sky(12, {0, 0, 0}); }, "above the horizon");
  test::expect_error([] { cie_sky(12, {0, -1, 0}, 1.5F); }, "ground");
}

}  // namespace
}  // namespace rebounce::test_sky_light
