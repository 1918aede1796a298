#include "precompute/patches/element_clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "precompute/patches/subdivision.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_element_clusters {
namespace {

double triangle_area(const DisplayMesh& mesh, std::uint32_t t) {
  const glm::dvec3 p = to_dvec3(mesh.position[mesh.triangle[t][0]]);
  return 0.5 * glm::length(glm::cross(to_dvec3(mesh.position[mesh.triangle[t][1]]) - p,
                                      to_dvec3(mesh.position[mesh.triangle[t][2]]) - p));
}

/// A room with balls and boxes of many sizes in it, from `seed`.
Scene furnished_room(std::uint32_t seed) {
  std::mt19937 engine(seed);
  const auto number = [&] { return engine() * 0x1p-32; };
  Scene scene = test::empty_scene();
  scene.materials.resize(4, scene.materials[0]);
  for (std::size_t m = 0; m < 4; ++m) {
    scene.materials[m].base_color = {0.2F * static_cast<float>(m), 0.5F, 0.7F};
  }
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, true);
  for (int k = 0; k < 6; ++k) {
    const std::size_t first = scene.position.size();
    test::add_ball(scene, 24, 12, false, 1 + k % 3);
    const double radius = 0.02 + 0.3 * number();
    const glm::dvec3 centre(0.5 + 4 * number(), 0.5 + 2 * number(), 0.5 + 3 * number());
    for (std::size_t v = first; v < scene.position.size(); ++v) {
      scene.position[v] = to_float3(centre + radius * to_dvec3(scene.position[v]));
    }
  }
  return scene;
}

TEST(ElementClusters, MeetThePatchCountAndConserveArea) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    for (const std::size_t wanted : {200U, 700U, 2000U}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(wanted) + " patches");
      const PatchModel model = make_patch_model(furnished_room(seed), {.patch_count = wanted});
      EXPECT_NEAR(static_cast<double>(model.patches.size()) / static_cast<double>(wanted), 1, 0.1);
      std::vector<double> area(model.patches.size(), 0.0);
      for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
        const std::uint32_t patch = model.mesh.triangle_patch[t];
        ASSERT_NE(patch, kNone) << "every side of this scene is lit";
        area[patch] += triangle_area(model.mesh, t);
      }
      for (std::size_t i = 0; i < area.size(); ++i) {
        EXPECT_NEAR(model.patches.area[i] / area[i], 1, 1e-5);
      }
    }
  }
}

TEST(ElementClusters, TheMeanReflectanceIsTheScenes) {
  const Scene scene = furnished_room(3);
  glm::dvec3 expected(0), found(0);
  const PatchModel model = make_patch_model(scene, {.patch_count = 300});
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    expected += triangle_area(model.mesh, t) *
                to_dvec3(scene.materials[model.mesh.triangle_material[t]].base_color);
  }
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    found += static_cast<double>(model.patches.area[i]) * to_dvec3(model.patches.reflectance[i]);
  }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 1e-5);
}

TEST(ElementClusters, NoPatchLiesOnTwoSidesOfAWall) {
  // A house of two rooms with a thin wall between them and a door in it; the wall's two faces are
  // joined at the door, the floor runs through.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {8, 3, 4}, true);
  test::add_box(scene, {3.95, 0, 0}, {4.05, 3, 3}, false);
  for (const std::size_t wanted : {100U, 400U, 1500U}) {
    Scene fine = scene;
    subdivide(fine, std::vector<std::uint8_t>(fine.triangle.size(), 1), {.patch_count = 6000});
    const PatchModel model = make_patch_model(fine, {.patch_count = wanted});
    const double door_reach = 12 / std::sqrt(static_cast<double>(wanted));
    std::vector<double> low(model.patches.size(), 1e9), high(model.patches.size(), -1e9);
    for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
      if (model.mesh.triangle_patch[t] == kNone) continue;
      double x = 0, z = 0;
      for (const std::uint32_t v : model.mesh.triangle[t]) {
        x += model.mesh.position[v][0] / 3.0;
        z += model.mesh.position[v][2] / 3.0;
      }
      // Those in the door are in both rooms, and the wall has a rim.
      if (z > 3 - door_reach || std::abs(x - 4) < 0.049) continue;
      low[model.mesh.triangle_patch[t]] = std::min(low[model.mesh.triangle_patch[t]], x);
      high[model.mesh.triangle_patch[t]] = std::max(high[model.mesh.triangle_patch[t]], x);
    }
    for (std::size_t i = 0; i < low.size(); ++i) {
      EXPECT_FALSE(low[i] < 3.96 && high[i] > 4.04) << "patch " << i << " of " << wanted;
    }
  }
}

TEST(ElementClusters, LampsAreNotMergedWithWalls) {
  Scene scene = furnished_room(2);
  scene.materials[1].emitted_luminance = {10, 10, 10};
  const PatchModel model = make_patch_model(scene, {.patch_count = 200});
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const bool lamp = model.mesh.triangle_material[t] == 1;
    const bool emits = model.patches.emitted_exitance[model.mesh.triangle_patch[t]][0] > 0;
    EXPECT_EQ(lamp, emits);
  }
}

/// Metres from corner to corner of the box around each patch.
std::vector<double> patch_lengths(const PatchModel& model) {
  std::vector<glm::vec3> low(model.patches.size(), glm::vec3(1e9F)), high(low.size(), -low[0]);
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const std::uint32_t patch = model.mesh.triangle_patch[t];
    if (patch == kNone) continue;
    for (const std::uint32_t v : model.mesh.triangle[t]) {
      low[patch] = glm::min(low[patch], to_glm(model.mesh.position[v]));
      high[patch] = glm::max(high[patch], to_glm(model.mesh.position[v]));
    }
  }
  std::vector<double> length;
  for (std::size_t i = 0; i < low.size(); ++i) length.push_back(glm::distance(low[i], high[i]));
  return length;
}

TEST(ElementClusters, WhatHidesItselfDoesNotMakePatchesGrow) {
  // A thicket, of which hardly two pieces see each other, in a room.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 4}, true);
  std::mt19937 engine(4);
  const auto number = [&] { return engine() * 0x1p-32 - 0.5; };
  for (int leaf = 0; leaf < 8000; ++leaf) {
    const glm::dvec3 p = glm::dvec3(2, 1, 2) + 1.2 * glm::dvec3(number(), number(), number());
    const auto step = [&] { return 0.3 * glm::dvec3(number(), number(), number()); };
    test::add_polygon(scene, std::vector<glm::dvec3>{p, p + step(), p + step()});
  }
  const PatchModel model = make_patch_model(scene, {.patch_count = 400});
  EXPECT_NEAR(static_cast<double>(model.patches.size()), 400, 40);
  double area = 0;
  for (const float a : model.patches.area) area += a;
  const double size = std::sqrt(area / 400);
  EXPECT_LT(std::ranges::max(patch_lengths(model)), 4.01 * size);
}

TEST(ElementClusters, TheLastTrianglesMayHaveNoElements) {
  // A wall across the room, which comes last and of which no side is asked for.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 4}, true);
  subdivide(scene, std::vector<std::uint8_t>(scene.triangle.size(), 1), {.patch_count = 300});
  Elements elements;
  elements.position = scene.position;
  elements.resize(scene.triangle.size());
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    const auto [a, b, c] = scene.triangle[t];
    const glm::dvec3 p = to_dvec3(scene.position[a]);
    const glm::dvec3 cross =
        glm::cross(to_dvec3(scene.position[b]) - p, to_dvec3(scene.position[c]) - p);
    elements.triangle[t] = t;
    elements.corner[t] = scene.triangle[t];
    elements.normal[t] = to_float3(glm::normalize(cross));
    elements.area[t] = static_cast<float>(0.5 * glm::length(cross));
  }
  const std::vector<glm::dvec3> wall = {{2, 0, 0}, {2, 0, 4}, {2, 3, 4}, {2, 3, 0}};
  test::add_polygon(scene, wall);
  const RayTracer tracer(scene.position, scene.triangle);
  EXPECT_EQ(merge_elements(elements, tracer, {.patch_count = 20}).patch_count, 20U);
}

TEST(ElementClusters, FragmentsDoNotTakeThePatches) {
  // Tubes and leaves in each other: thousands of pieces that do not see each other.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 4}, true);
  std::mt19937 engine(7);
  const auto number = [&] { return engine() * 0x1p-32 - 0.5; };
  for (int k = 0; k < 600; ++k) {
    const glm::dvec3 p = glm::dvec3(2, 1, 2) + glm::dvec3(number(), number(), number());
    const glm::dvec3 half(0.01 + 0.01 * number(), 0.3 + 0.2 * number(), 0.02 + 0.02 * number());
    test::add_box(scene, p - half, p + half, false);
  }
  const PatchModel model = make_patch_model(scene, {.patch_count = 500});
  EXPECT_NEAR(static_cast<double>(model.patches.size()), 500, 50);
  double area = 0;
  for (const float a : model.patches.area) area += a;
  const auto fragments =
      std::ranges::count_if(model.patches.area, [&](float a) { return a < area / 500 / 64; });
  EXPECT_LE(fragments, 25);
  EXPECT_LT(std::ranges::max(model.patches.area), 8 * area / 500);
}

TEST(ElementClusters, ManyElementsMakeTheSamePatchesOnAnyNumberOfThreads) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, true);
  subdivide(scene, std::vector<std::uint8_t>(scene.triangle.size(), 1), {.patch_count = 80000});
  const auto make = [&] { return make_patch_model(scene, {.patch_count = 1000}); };
  const PatchModel alone = test::with_threads(1, make), shared = test::with_threads(3, make);
  EXPECT_EQ(alone.patches.size(), 1000U);
  EXPECT_EQ(alone.mesh.triangle_patch, shared.mesh.triangle_patch);
  EXPECT_EQ(alone.patches.centroid, shared.patches.centroid);
  // The box around a disc of the mean area is 1.6 mean sizes long, and patches have ragged rims.
  std::vector<double> length = patch_lengths(alone);
  std::ranges::sort(length);
  const double size = std::sqrt(94.0 / 1000);
  EXPECT_LT(length[length.size() / 2], 2 * size);
  EXPECT_LT(length.back(), 4.01 * size);
}

TEST(ElementClusters, DisconnectedLeavesBecomeFewPatches) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 4}, true);
  std::mt19937 engine(9);
  const auto number = [&] { return engine() * 0x1p-32 - 0.5; };
  for (int leaf = 0; leaf < 1000; ++leaf) {
    const glm::dvec3 p = glm::dvec3(2, 1, 2) + 0.4 * glm::dvec3(number(), number(), number());
    const auto step = [&] { return 0.05 * glm::dvec3(number(), number(), number()); };
    test::add_polygon(scene, std::vector<glm::dvec3>{p, p + step(), p + step()});
  }
  const PatchModel model = make_patch_model(scene, {.patch_count = 300});
  EXPECT_LE(model.patches.size(), 330U);
}

}  // namespace
}  // namespace rebounce::test_element_clusters
