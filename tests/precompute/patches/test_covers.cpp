// Surfaces that others lie close above.

#include "precompute/patches/covers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "precompute/patches/patch_model.h"
#include "precompute/patches/subdivision.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_covers {
namespace {

// The board hangs this high above the floor and ends at this x.
constexpr double kHeight = 0.02, kEnd = 0.28;

/// A floor of 2 x 2 m around the origin, and above the part x < kEnd of it a board of triangles
/// that are far smaller than patches.
Scene floor_under_board() {
  Scene scene = test::empty_scene();
  const std::vector<glm::dvec3> floor = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
  test::add_polygon(scene, floor);
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].double_sided = true;
  constexpr int kSquares = 40;
  for (int i = 0; i < kSquares; ++i) {
    for (int j = 0; j < kSquares; ++j) {
      const auto x = [&](int k) { return -1 + (kEnd + 1) * k / kSquares; };
      const auto z = [&](int k) { return -1 + 2.0 * k / kSquares; };
      const std::vector<glm::dvec3> square = {{x(i), kHeight, z(j)},
                                              {x(i), kHeight, z(j + 1)},
                                              {x(i + 1), kHeight, z(j + 1)},
                                              {x(i + 1), kHeight, z(j)}};
      test::add_polygon(scene, square, 1);
    }
  }
  return scene;
}

TEST(Covers, ThePartOfATriangleThatIsCovered) {
  const Scene scene = floor_under_board();
  const RayTracer tracer(scene.position, scene.triangle);
  const auto part = [&](double x, double height, std::uint32_t count) {
    return covered_part({glm::dvec3(x, 0, 0), {x, 0, 0.2}, {x + 0.2, 0, 0}}, tracer, height, count);
  };
  EXPECT_EQ(part(0, 0.1, 16), 1);
  EXPECT_EQ(part(0, 0.1, 1), 1);
  EXPECT_EQ(part(0.4, 0.1, 16), 0);
  EXPECT_EQ(part(0, 0.01, 16), 0) << "what hangs higher does not count";
  // Half way along x lies a quarter of the triangle beyond.
  EXPECT_NEAR(part(kEnd - 0.1, 0.1, 16), 0.75, 0.1);
}

TEST(Covers, OnlyWhatIsWhollyCoveredIs) {
  const Scene scene = floor_under_board();
  const RayTracer tracer(scene.position, scene.triangle);
  const auto covered = [&](double x, double height) {
    return is_covered({glm::dvec3(x, 0, 0), {x, 0, 0.2}, {x + 0.2, 0, 0}}, tracer, height);
  };
  EXPECT_TRUE(covered(0, 0.1));
  EXPECT_FALSE(covered(0, 0.01)) << "what hangs higher does not count";
  EXPECT_FALSE(covered(0.4, 0.1));
  EXPECT_FALSE(covered(kEnd - 0.1, 0.1));
  EXPECT_FALSE(covered(kEnd - 0.18, 0.1)) << "a corner stands out";
}

TEST(Covers, NothingCoversATriangleWithoutArea) {
  // Cuts leave some, and rays along no direction must not be traced.
  Scene scene = floor_under_board();
  const std::vector<glm::dvec3> line = {{-0.5, 0, 0}, {0, 0, 0}, {0.5, 0, 0}};
  test::add_polygon(scene, line);
  const RayTracer tracer(scene.position, scene.triangle);
  EXPECT_EQ(covered_part({line[0], line[1], line[2]}, tracer, 0.1, 16), 0);
  EXPECT_FALSE(is_covered({line[0], line[1], line[2]}, tracer, 0.1));
  const std::vector<TriangleSides> sides(scene.triangle.size());
  EXPECT_GT(refine_at_covers(scene, sides, tracer, 0.2, 500).size(), sides.size());
}

TEST(Covers, TrianglesAreSmallWhereACoverEnds) {
  Scene scene = floor_under_board();
  const RayTracer tracer(scene.position, scene.triangle);
  const std::vector<TriangleSides> sides = find_lit_sides(scene, tracer);
  const Scene before = scene;
  constexpr double kSize = 0.4;
  const std::vector<std::uint32_t> source = refine_at_covers(scene, sides, tracer, kSize, 4000);
  ASSERT_EQ(source.size(), scene.triangle.size());
  double area = 0;
  std::size_t at_end = 0;
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    if (scene.triangle_material[t] != 0) continue;
    const TriangleCorners p = corners_of(scene, t);
    area += area_of(p);
    const auto [low, high] = std::minmax({p[0].x, p[1].x, p[2].x});
    // Points may miss a part of a sixteenth.
    if (low > kEnd - 0.02 || high < kEnd + 0.02) continue;
    ++at_end;
    EXPECT_LT(high - low, 0.3 * kSize + 1e-6);
  }
  EXPECT_NEAR(area, 4, 1e-5);
  EXPECT_GT(at_end, 20U);
  EXPECT_LT(scene.triangle.size(), before.triangle.size() + 1000) << "only where the cover ends";
}

TEST(Covers, NoMoreTrianglesAreAddedThanMayBe) {
  Scene scene = floor_under_board();
  const RayTracer tracer(scene.position, scene.triangle);
  const std::size_t before = scene.triangle.size();
  refine_at_covers(scene, find_lit_sides(scene, tracer), tracer, 0.05, 200);
  EXPECT_GE(scene.triangle.size(), before + 200);
  EXPECT_LT(scene.triangle.size(), before + 240) << "but for the last one's neighbours";
}

TEST(Covers, PatchesEndWhereCoversDo) {
  const PatchModel model = make_patch_model(floor_under_board(), {.patch_count = 300});
  std::vector<double> covered(model.patches.size()), area(covered.size());
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const std::uint32_t patch = model.mesh.triangle_patch[t];
    if (model.mesh.triangle_material[t] != 0 || patch == kNone) continue;
    const TriangleCorners p = corners_of(model.mesh, t);
    area[patch] += area_of(p);
    covered[patch] += (p[0].x + p[1].x + p[2].x) / 3 < kEnd ? area_of(p) : 0;
  }
  double whole = 0, mixed = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    whole += area[i];
    mixed += std::min(covered[i], area[i] - covered[i]);
  }
  EXPECT_NEAR(whole, 4, 1e-4);
  // Without a look at covers it is some 0.1 m².
  EXPECT_LT(mixed, 0.03);
}

}  // namespace
}  // namespace rebounce::test_covers
