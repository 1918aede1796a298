// Insides of closed double-sided shells.

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>

#include "precompute/patches/lit_sides.h"
#include "precompute/patches/patch_model.h"
#include "precompute/patches/subdivision.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_enclosed_sides {
namespace {

constexpr std::uint32_t kRoom = 0, kShell = 1, kLamp = 2;
const glm::dvec3 kLow(2, 0.5, 1.5), kHigh(3, 1.0, 2.0);  // of the shell

/// Nothing yet; material kShell is double-sided, kLamp emits.
Scene nothing() {
  Scene scene = test::empty_scene();
  scene.materials.resize(3, scene.materials[0]);
  scene.materials[kShell].double_sided = true;
  scene.materials[kLamp].emitted_luminance = {100, 100, 100};
  return scene;
}

void add_room(Scene& scene, std::uint32_t material = kRoom) {
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, true, material);
}

/// A room of one-sided walls.
Scene room() {
  Scene scene = nothing();
  add_room(scene);
  return scene;
}

/// A shell without its face +z.
void add_open_box(Scene& scene, const glm::dvec3& low, const glm::dvec3& high) {
  test::add_box(scene, low, high, false, kShell);
  scene.triangle.resize(scene.triangle.size() - 2);
  scene.triangle_material.resize(scene.triangle.size());
}

void refine(Scene& scene, std::size_t count) {
  subdivide(scene, std::vector<std::uint8_t>(scene.triangle.size(), 1), {.patch_count = count});
}

/// A room with a shell of about 2,000 triangles, with a hole of so many metres square in its face
/// +z.
Scene room_with_holed_shell(double width) {
  Scene scene = nothing();
  test::add_box(scene, kLow, kHigh, false, kShell);
  refine(scene, 2000);
  const glm::dvec3 middle = (kLow + kHigh) / 2.0;
  std::size_t kept = 0;
  for (const Uint3& triangle : scene.triangle) {
    glm::dvec3 centroid(0);
    for (const std::uint32_t v : triangle) centroid += to_dvec3(scene.position[v]) / 3.0;
    const bool in_hole = std::abs(centroid.x - middle.x) < width / 2 &&
                         std::abs(centroid.y - middle.y) < width / 2 && centroid.z > kHigh.z - 1e-6;
    if (!in_hole) scene.triangle[kept++] = triangle;
  }
  EXPECT_LT(kept, scene.triangle.size());
  scene.triangle.resize(kept);
  scene.triangle_material.resize(kept);
  add_room(scene);
  return scene;
}

/// How many of the inner and the outer sides of the shell are lit and how many are buried.
struct ShellSides {
  int lit_inside = 0, lit_outside = 0, buried_inside = 0, buried_outside = 0;
};

ShellSides sides_of_shell(const Scene& scene) {
  const std::vector<TriangleSides> sides =
      find_lit_sides(scene, RayTracer(scene.position, scene.triangle));
  ShellSides count;
  for (std::uint32_t t = 0; t < sides.size(); ++t) {
    if (scene.triangle_material[t] != kShell) continue;
    count.lit_outside += sides[t].front == SideKind::kLit ? 1 : 0;
    count.buried_outside += sides[t].front == SideKind::kBuried ? 1 : 0;
    count.lit_inside += sides[t].back == SideKind::kLit ? 1 : 0;
    count.buried_inside += sides[t].back == SideKind::kBuried ? 1 : 0;
  }
  return count;
}

TEST(EnclosedSides, TheInsideOfAClosedShellIsBuried) {
  Scene scene = room();
  test::add_box(scene, kLow, kHigh, false, kShell);
  refine(scene, 2000);
  const ShellSides count = sides_of_shell(scene);
  EXPECT_EQ(count.lit_inside, 0);
  EXPECT_EQ(count.buried_outside, 0);
  EXPECT_EQ(count.buried_inside, count.lit_outside);
}

TEST(EnclosedSides, ShellsThatPassThroughEachOtherAreInsideToo) {
  Scene scene = room();
  test::add_box(scene, kLow, kHigh, false, kShell);
  test::add_box(scene, kLow + glm::dvec3(0.613, 0.207, 0.118), kHigh + glm::dvec3(0.4, 0.3, -0.1),
                false, kShell);
  refine(scene, 40000);
  const ShellSides count = sides_of_shell(scene);
  // A triangle that another passes through sees both in and out, and what is beside it sees it.
  EXPECT_LT(count.lit_inside, count.buried_inside / 4);
  EXPECT_GT(count.buried_inside, count.lit_outside / 2);
}

TEST(EnclosedSides, AShellThatAWallClosesIsBuried) {
  // The wall's triangles are large, for the most part outside, and one-sided or double-sided.
  for (const std::uint32_t wall : {kRoom, kShell}) {
    Scene scene = nothing();
    add_open_box(scene, {2, 0.5, 3.5}, {3, 1, 4});
    refine(scene, 500);
    const std::size_t shell_count = scene.triangle.size();
    add_room(scene, wall);
    const std::vector<TriangleSides> sides =
        find_lit_sides(scene, RayTracer(scene.position, scene.triangle));
    for (std::uint32_t t = 0; t < shell_count; ++t) {
      EXPECT_EQ(sides[t].front, SideKind::kLit);
      EXPECT_EQ(sides[t].back, SideKind::kBuried);
    }
    for (std::size_t t = shell_count; t < sides.size(); ++t) {
      EXPECT_EQ(sides[t].front, SideKind::kLit);
    }
  }
}

TEST(EnclosedSides, TheBottomOfAWhiteShaftIsLit) {
  // Eight times as deep as wide: of what a dark one gets next to nothing comes back.
  for (const bool white : {false, true}) {
    Scene scene = room();
    const float rho = white ? 0.98F : 0.3F;
    scene.materials[kShell].base_color = {rho, rho, rho};
    const std::size_t first = scene.triangle.size();
    add_open_box(scene, {2, 0.5, 1}, {2.1, 0.6, 1.8});
    const std::vector<TriangleSides> sides =
        find_lit_sides(scene, RayTracer(scene.position, scene.triangle));
    const auto bottom = first + 2 * static_cast<std::size_t>(test::Face::kLowZ);
    for (const std::size_t t : {bottom, bottom + 1}) {
      EXPECT_EQ(sides[t].back, white ? SideKind::kLit : SideKind::kBuried);
      EXPECT_EQ(sides[t].front, SideKind::kLit);
    }
  }
}

TEST(EnclosedSides, AWallThatLooksOutFromBehindABoardIsLit) {
  // Of the wall's triangle 2 % are seen, beside a board 2 cm before it that hides the rest.
  Scene scene = room();
  const std::vector<glm::dvec3> wall = {{1, 0.5, 0.1}, {3, 0.5, 0.1}, {1, 2.5, 0.1}};
  test::add_polygon(scene, wall, kShell);
  test::add_box(scene, {1.02, 0.4, 0.1}, {3.1, 2.6, 0.12}, false, kShell);
  const std::vector<TriangleSides> sides =
      find_lit_sides(scene, RayTracer(scene.position, scene.triangle));
  for (std::uint32_t t = 0; t < sides.size(); ++t) {
    EXPECT_EQ(sides[t].front, SideKind::kLit) << t;
  }
}

TEST(EnclosedSides, AnOpenBoxIsLit) {
  Scene scene = room();
  add_open_box(scene, kLow, kHigh);
  refine(scene, 2000);
  const ShellSides count = sides_of_shell(scene);
  EXPECT_EQ(count.buried_inside, 0);
  EXPECT_EQ(count.lit_inside, count.lit_outside);
}

TEST(EnclosedSides, AShellWithACrackIsBuriedAndOneWithAHoleIsLit) {
  // Of the shell's area 0.4 % are missing, then 10 %: about twice as many of the paths get out.
  const ShellSides crack = sides_of_shell(room_with_holed_shell(0.1));
  EXPECT_EQ(crack.buried_outside, 0);
  EXPECT_GT(crack.buried_inside, 0.98 * crack.lit_outside);
  const ShellSides hole = sides_of_shell(room_with_holed_shell(0.5));
  EXPECT_EQ(hole.buried_outside, 0);
  EXPECT_GT(hole.lit_inside, 0.98 * hole.lit_outside);
}

TEST(EnclosedSides, AreTheSameForAnyNumberOfThreads) {
  // About 4 % of the paths get out: there is doubt about every side.
  const Scene scene = room_with_holed_shell(0.22);
  const RayTracer tracer(scene.position, scene.triangle);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const std::vector<TriangleSides> one = find_lit_sides(scene, tracer);
  omp_set_num_threads(3);
  const std::vector<TriangleSides> three = find_lit_sides(scene, tracer);
  omp_set_num_threads(threads);
  std::size_t buried = 0;
  for (std::size_t t = 0; t < one.size(); ++t) {
    EXPECT_EQ(one[t].front, three[t].front);
    EXPECT_EQ(one[t].back, three[t].back);
    buried += one[t].back == SideKind::kBuried ? 1 : 0;
  }
  EXPECT_GT(buried, one.size() / 10);
  EXPECT_LT(buried, one.size() * 9 / 10);
}

TEST(EnclosedSides, ALanternIsLit) {
  Scene scene = room();
  test::add_box(scene, kLow, kHigh, false, kShell);
  const glm::dvec3 middle = (kLow + kHigh) / 2.0, half(0.1);
  test::add_box(scene, middle - half, middle + half, false, kLamp);
  refine(scene, 2000);
  EXPECT_EQ(sides_of_shell(scene).buried_inside, 0);
}

TEST(EnclosedSides, AClosedRoomOfDoubleSidedWallsIsLit) {
  Scene scene = room();
  test::add_box(scene, {10, 0, 0}, {12, 2.5, 2}, false, kShell);
  refine(scene, 2000);
  EXPECT_EQ(sides_of_shell(scene).buried_inside, 0);
}

TEST(EnclosedSides, NoPatchHoldsTheInsideAndTheOutsideOfAShell) {
  // An open box, so that both have patches, of triangles far smaller than they are.
  Scene box = room();
  add_open_box(box, kLow, kHigh);
  refine(box, 8000);
  for (const std::size_t wanted : {700U, 2000U}) {
    const PatchModel model = make_patch_model(box, {.patch_count = wanted});
    const DisplayMesh& mesh = model.mesh;
    std::vector<std::uint8_t> has_front(model.patches.size(), 0), has_back(has_front);
    for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
      if (mesh.triangle_material[t] != kShell) continue;
      has_front[mesh.triangle_patch[t]] = 1;
      has_back[mesh.triangle_patch[mesh.back_triangle[t]]] = 1;
    }
    for (std::size_t i = 0; i < has_front.size(); ++i) {
      EXPECT_FALSE(has_front[i] != 0 && has_back[i] != 0) << "patch " << i << " of " << wanted;
    }
  }
}

}  // namespace
}  // namespace rebounce::test_enclosed_sides
