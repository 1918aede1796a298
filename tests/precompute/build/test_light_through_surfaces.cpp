// Masks, blends and glass: what they stop, what they let through, and what it does to patches.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/patches/opacity_sampling.h"
#include "runtime/frame/direct_lighting.h"
#include "runtime/rays/patch_points.h"
#include "tests/support/scene_data.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_light_through_surfaces {
namespace {

constexpr std::uint32_t kWall = 0, kPane = 1, kOther = 2;

/// Materials: kWall and kOther opaque, kPane as the test wants it; and a texture of squares, every
/// other of them white and there, the rest black and not.
Scene scene_with_pane(int squares = 8) {
  Scene scene = test::empty_scene();
  scene.materials.resize(3, scene.materials[0]);
  scene.materials[kPane].double_sided = true;
  constexpr int kTexels = 16;  // a square is so wide
  Image image{squares * kTexels, squares * kTexels, {}};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const bool there = (x / kTexels + y / kTexels) % 2 == 0;
      const auto value = static_cast<std::uint8_t>(there ? 255 : 0);
      image.rgba.insert(image.rgba.end(), {value, value, value, value});
    }
  }
  scene.images.push_back(image);
  scene.textures.emplace_back();
  return scene;
}

Material& pane(Scene& scene) {
  return scene.materials[kPane];
}

void make_checker(Scene& scene) {
  pane(scene).alpha_mode = AlphaMode::kMask;
  pane(scene).base_color_texture = 0;
}

void make_glass(Scene& scene, float transmission) {
  pane(scene).transmission = transmission;
}

/// A square of side `size` in the plane y = height around the axis, texture coordinates 0 to 1.
void add_square(Scene& scene, double size, double height, bool up, std::uint32_t material) {
  const double h = size / 2;
  std::vector<glm::dvec3> corner = {
      {-h, height, -h}, {-h, height, h}, {h, height, h}, {h, height, -h}};
  if (!up) std::swap(corner[1], corner[3]);
  const std::size_t first = scene.position.size();
  test::add_polygon(scene, corner, material);
  for (std::size_t v = first; v < scene.position.size(); ++v) {
    for (const int axis : {0, 2}) {
      scene.base_color_texcoord[v][axis / 2] =
          static_cast<float>(scene.position[v][axis] / size + 0.5);
    }
  }
}

struct Solved {
  PatchModel model;
  FormFactors f;
};

Solved solve(const Scene& scene, std::size_t patches) {
  Solved solved{make_patch_model(scene, {.patch_count = patches}), {}};
  solved.f = compute_form_factors(solved.model, test::make_tracer(solved.model), {});
  return solved;
}

double exchange_between(const Solved& s, std::uint32_t a, std::uint32_t b) {
  double sum = 0;
  for (std::size_t i = 0; i < s.model.patches.size(); ++i) {
    const std::uint32_t from = test::material_of(s.model, i);
    for (std::uint64_t k = s.f.exchange.row_begin[i]; k < s.f.exchange.row_begin[i + 1]; ++k) {
      const std::uint32_t to = test::material_of(s.model, s.f.exchange.column[k]);
      if ((from == a && to == b) || (from == b && to == a)) sum += s.f.exchange.exchange_area[k];
    }
  }
  return sum;
}

/// Two squares of side 1 that face each other at distance 1, and a pane in between, wide enough
/// that no ray passes beside it.
Scene squares_and_pane(Scene scene) {
  add_square(scene, 1, 0, true, kWall);
  add_square(scene, 1, 1, false, kOther);
  add_square(scene, 1.2, 0.5, true, kPane);
  return scene;
}

// Howell's catalogue C-11: equal squares at a distance of their side.
constexpr double kFacingSquares = 0.199825;

TEST(LightThroughSurfaces, ACheckerMaskHalvesTheExchange) {
  Scene scene = scene_with_pane();
  make_checker(scene);
  const Solved s = solve(squares_and_pane(scene), 300);
  EXPECT_NEAR(exchange_between(s, kWall, kOther), 0.5 * kFacingSquares, 0.01 * kFacingSquares);
  double area = 0;
  for (std::size_t i = 0; i < s.model.patches.size(); ++i) {
    if (test::material_of(s.model, i) == kPane) area += s.model.patches.area[i];
  }
  // Both sides of what is there, at about one sample a texel.
  EXPECT_NEAR(area, 2 * 0.5 * 1.44, 0.03);
}

TEST(LightThroughSurfaces, GlassAndBlendsLetTheirPartThrough) {
  Scene scene = scene_with_pane();
  make_glass(scene, 0.9F);
  EXPECT_NEAR(exchange_between(solve(squares_and_pane(scene), 100), kWall, kOther),
              0.9 * kFacingSquares, 2e-3 * kFacingSquares + 1e-4);
  scene = scene_with_pane();
  pane(scene).alpha_mode = AlphaMode::kBlend;
  pane(scene).base_alpha = 0.25F;
  EXPECT_NEAR(exchange_between(solve(squares_and_pane(scene), 100), kWall, kOther),
              0.75 * kFacingSquares, 2e-3 * kFacingSquares + 1e-4);
}

TEST(LightThroughSurfaces, AClearPaneChangesNothing) {
  Scene scene = scene_with_pane();
  make_glass(scene, 1);
  Scene bare = scene;
  add_square(bare, 1, 0, true, kWall);
  add_square(bare, 1, 1, false, kOther);
  const Solved with = solve(squares_and_pane(scene), 4), without = solve(bare, 4);
  EXPECT_EQ(with.model.patches.size(), without.model.patches.size());
  EXPECT_EQ(with.model.opening_side_count, 4U);
  const auto expect_equal = [](const auto& a, const auto& b) {
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
  };
  expect_equal(with.f.exchange.column, without.f.exchange.column);
  expect_equal(with.f.exchange.exchange_area, without.f.exchange.exchange_area);
  expect_equal(with.f.sky_visibility, without.f.sky_visibility);
}

TEST(LightThroughSurfaces, ARoomWithAFenceInsideIsClosed) {
  Scene scene = scene_with_pane();
  make_checker(scene);
  test::add_box(scene, {-1.5, -0.5, -1.5}, {1.5, 1.5, 1.5}, true, kWall);
  add_square(scene, 2, 0.5, true, kPane);
  const Solved s = solve(scene, 500);
  EXPECT_LT(s.f.closure.relative_change, 0.03);
  std::vector<double> sum(s.model.patches.size(), 0.0);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (std::uint64_t k = s.f.exchange.row_begin[i]; k < s.f.exchange.row_begin[i + 1]; ++k) {
      const std::size_t j = s.f.exchange.column[k];
      sum[i] += s.f.exchange.exchange_area[k] / s.model.patches.area[i];
      sum[j] += s.f.exchange.exchange_area[k] / s.model.patches.area[j];
    }
  }
  for (const double row : sum) EXPECT_NEAR(row, 1, 1e-6);
}

TEST(LightThroughSurfaces, ReflectanceIsThatOfWhatIsThere) {
  Scene scene = scene_with_pane();
  make_checker(scene);
  const PatchModel model = make_patch_model(squares_and_pane(scene), {.patch_count = 50});
  int panes = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    if (test::material_of(model, i) != kPane) continue;
    ++panes;
    EXPECT_GT(model.patches.reflectance[i][0], 0.9 * 0.5) << "white; the black is not there";
  }
  EXPECT_GT(panes, 4);
}

TEST(LightThroughSurfaces, SidesWithNothingThereHaveNoPatch) {
  Scene scene = scene_with_pane(2);  // quarters of the pane
  make_checker(scene);
  const PatchModel model = make_patch_model(squares_and_pane(scene), {.patch_count = 1000});
  std::size_t openings = 0, full = 0;
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const double part = model.mesh.opacity.stopping_part(t);
    openings += part == 0 ? 1 : 0;
    full += model.mesh.triangle_material[t] == kPane && part == 1 ? 1 : 0;
    EXPECT_EQ(model.mesh.triangle_patch[t] == kNone, part == 0);
  }
  EXPECT_EQ(model.opening_side_count, openings);
  EXPECT_GT(openings, 100U);
  EXPECT_GT(full, 100U);
}

TEST(LightThroughSurfaces, PointsLieOnWhatIsThere) {
  Scene scene = scene_with_pane();
  make_checker(scene);
  const PatchModel model = make_patch_model(squares_and_pane(scene), {.patch_count = 50});
  const PatchTriangles triangles(model.mesh.triangle_patch, model.patches.size());
  int on_squares = 0, count = 0;
  std::array<int, 4> in_quarter{};
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    if (test::material_of(model, i) != kPane) continue;
    std::array<PatchPoint, 256> points;
    spread_points(model.mesh, triangles[i], {0.1, 0.2}, points);
    for (const PatchPoint& p : points) {
      const auto square = [](float x) { return static_cast<int>(std::floor((x / 1.2 + 0.5) * 8)); };
      on_squares += (square(p.position[0]) + square(p.position[2])) % 2 == 0;
      ++in_quarter[(p.position[0] > 0 ? 1 : 0) + (p.position[2] > 0 ? 2 : 0)];
      ++count;
    }
  }
  EXPECT_GT(on_squares, 0.95 * count) << "rims of a micro-triangle's width are left and right";
  for (const int k : in_quarter) EXPECT_NEAR(k, 0.25 * count, 0.03 * count);
}

TEST(LightThroughSurfaces, LampsShineThroughGlass) {
  Scene scene = scene_with_pane();
  make_glass(scene, 0.75F);
  add_square(scene, 1, 0, true, kWall);
  add_square(scene, 4, 0.5, true, kPane);
  const PatchModel model = make_patch_model(scene, {.patch_count = 60});
  const TransferData data = test::data_of(model);
  Light sun;
  sun.type = LightType::kDirectional;
  sun.intensity = 100;
  std::vector<Float3> direct(data.patches.size());
  DirectLighting(data, test::make_tracer(model)).compute({&sun, 1}, {}, direct);
  int below = 0;
  for (std::size_t i = 0; i < direct.size(); ++i) {
    if (test::material_of(model, i) != kWall) continue;
    EXPECT_NEAR(direct[i][1], 75, 0.3);
    ++below;
  }
  EXPECT_GT(below, 1);
}

TEST(OpacitySampling, MapsAreAsFineAsWhatTheyTell) {
  Scene scene = scene_with_pane(8);
  make_checker(scene);
  add_square(scene, 1, 0, true, kPane);
  add_square(scene, 1, 1, true, kWall);
  const OpacityMaps maps = find_opacity_maps(scene);
  EXPECT_EQ(maps.of_triangle(0).size(), 64U) << "squares of two micro-triangles";
  EXPECT_DOUBLE_EQ(maps.stopping_part(0), 0.5);
  EXPECT_TRUE(maps.of_triangle(2).empty()) << "the wall is opaque";
}

TEST(OpacitySampling, WithoutTextureCoordinatesOneTexelDecides) {
  Scene scene = scene_with_pane(8);
  make_checker(scene);
  add_square(scene, 1, 0, true, kPane);
  scene.base_color_texcoord.assign(scene.position.size(), Float2{0.05F, 0.2F});
  const OpacityMaps maps = find_opacity_maps(scene);
  EXPECT_EQ(maps.opacity, std::vector<std::uint8_t>{0});
}

TEST(OpacitySampling, EqualMapsAreStoredOnce) {
  Scene scene = scene_with_pane();
  make_glass(scene, 0.5F);
  for (int k = 0; k < 5; ++k) add_square(scene, 1, k, true, kPane);
  const OpacityMaps maps = find_opacity_maps(scene);
  EXPECT_EQ(maps.map_count(), 1U);
  EXPECT_EQ(maps.opacity, std::vector<std::uint8_t>{128});
}

TEST(OpacitySampling, NothingToLetThroughMeansNoMaps) {
  Scene scene = scene_with_pane();
  pane(scene).alpha_mode = AlphaMode::kBlend;  // of alpha 1
  add_square(scene, 1, 0, true, kPane);
  EXPECT_TRUE(find_opacity_maps(scene).empty());
  make_glass(scene, 0.9F);
  pane(scene).emitted_luminance = {0, 0, 1};
  EXPECT_TRUE(find_opacity_maps(scene).empty()) << "what emits does not transmit";
}

}  // namespace
}  // namespace rebounce::test_light_through_surfaces
