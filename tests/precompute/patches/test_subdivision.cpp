#include "precompute/patches/subdivision.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "precompute/base/edge_table.h"
#include "precompute/patches/welded_positions.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_subdivision {
namespace {

double area_of(const Scene& scene, std::size_t t) {
  const auto [a, b, c] = scene.triangle[t];
  const glm::dvec3 p = to_dvec3(scene.position[a]);
  return 0.5 *
         glm::length(glm::cross(to_dvec3(scene.position[b]) - p, to_dvec3(scene.position[c]) - p));
}

Scene room() {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1, 0, 1}, {2, 1.2, 2.5}, false);
  return scene;
}

std::vector<std::uint8_t> one_each(const Scene& scene) {
  return std::vector<std::uint8_t>(scene.triangle.size(), 1);
}

TEST(Subdivision, MeetsThePatchCountOnLargePolygons) {
  for (const std::size_t wanted : {100U, 1000U, 4000U, 20000U}) {
    Scene scene = room();
    subdivide(scene, one_each(scene), {.patch_count = wanted});
    EXPECT_NEAR(static_cast<double>(scene.triangle.size()) / static_cast<double>(wanted), 1, 0.05);
  }
}

TEST(Subdivision, CountsBothSidesOfATriangle) {
  Scene scene = room();
  const std::vector<std::uint8_t> two(scene.triangle.size(), 2);
  subdivide(scene, two, {.patch_count = 1000});
  EXPECT_NEAR(static_cast<double>(scene.triangle.size()), 500, 25);
}

TEST(Subdivision, KeepsAreaMaterialAndSource) {
  Scene scene = room();
  const Scene before = scene;
  const auto source = subdivide(scene, one_each(scene), {.patch_count = 2000});
  std::vector<double> area(before.triangle.size(), 0.0);
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    area[source[t]] += area_of(scene, t);
    EXPECT_EQ(scene.triangle_material[t], before.triangle_material[source[t]]);
    if (t > 0) {
      EXPECT_GE(source[t], source[t - 1]) << "neighbours stay together";
    }
  }
  for (std::size_t t = 0; t < area.size(); ++t) {
    EXPECT_NEAR(area[t], area_of(before, t), 1e-5 * area_of(before, t));
  }
}

TEST(Subdivision, LimitsTheEdgeLength) {
  Scene scene = room();
  subdivide(scene, one_each(scene), {.patch_count = 0, .patch_size = 0.4F});
  float longest = 0;
  for (const Uint3& t : scene.triangle) {
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 d = to_glm(scene.position[t[k]]) - to_glm(scene.position[t[(k + 1) % 3]]);
      longest = std::max(longest, glm::length(d));
    }
  }
  EXPECT_LE(longest, 0.4F);
  EXPECT_GT(longest, 0.2F);
}

TEST(Subdivision, MakesNoTJunctions) {
  // In a closed surface every edge, by the positions of its ends, belongs to two triangles.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  subdivide(scene, one_each(scene), {.patch_count = 3000});
  const WeldedPositions welded = weld_positions(scene.position);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Uint3& t : scene.triangle) {
    for (int k = 0; k < 3; ++k) {
      ++uses[std::minmax(welded.id[t[k]], welded.id[t[(k + 1) % 3]])];
    }
  }
  for (const auto& [edge, count] : uses) ASSERT_EQ(count, 2);
}

TEST(Subdivision, KeepsTrianglesWellShaped) {
  // Rivara: the smallest angle never falls below half of the smallest there was.
  std::mt19937 engine(11);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Scene scene = test::empty_scene();
  const auto smallest_angle = [&] {
    double smallest = 10;
    for (const Uint3& t : scene.triangle) {
      for (int k = 0; k < 3; ++k) {
        const glm::dvec3 at = to_dvec3(scene.position[t[k]]);
        const glm::dvec3 u = to_dvec3(scene.position[t[(k + 1) % 3]]) - at;
        const glm::dvec3 v = to_dvec3(scene.position[t[(k + 2) % 3]]) - at;
        smallest = std::min(smallest, std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)));
      }
    }
    return smallest;
  };
  for (int k = 0; k < 20; ++k) {
    const std::vector<glm::dvec3> corners = {{uniform(engine), uniform(engine), uniform(engine)},
                                             {uniform(engine), uniform(engine), uniform(engine)},
                                             {uniform(engine), uniform(engine), uniform(engine)}};
    test::add_polygon(scene, corners);
  }
  const double before = smallest_angle();
  subdivide(scene, one_each(scene), {.patch_count = 5000});
  EXPECT_GE(smallest_angle(), 0.499 * before);
}

TEST(Subdivision, IsDeterministic) {
  Scene a = room(), b = room();
  subdivide(a, one_each(a), {.patch_count = 1500});
  subdivide(b, one_each(b), {.patch_count = 1500});
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.triangle, b.triangle);
}

TEST(Subdivision, RefusesMeshesOfMoreTrianglesThanTheirSidesHaveNumbers) {
  check_triangle_count(kMostTriangles);
  const auto no_corner = [](std::uint32_t) { return Uint3{}; };
  for (const std::size_t count : {kMostTriangles + 1, std::size_t{1} << 40U}) {
    test::expect_error(
        [&] { EdgeTable(count, 0, no_corner); },
        "a mesh may have at most 1431655765 triangles, not " + std::to_string(count));
  }
}

TEST(WeldedPositions, JoinsEqualPlacesOnly) {
  const std::vector<Float3> position = {{0, 0, 0}, {1, 0, 0}, {-0.0F, 0, 0}, {1, 0, 1e-7F}};
  const WeldedPositions welded = weld_positions(position);
  EXPECT_EQ(welded.count, 3U);
  EXPECT_EQ(welded.id[0], welded.id[2]);
  EXPECT_NE(welded.id[1], welded.id[3]);
}

}  // namespace
}  // namespace rebounce::test_subdivision
