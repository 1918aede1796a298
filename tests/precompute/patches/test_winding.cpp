// Which pieces of a scene are found to be seen from behind, on scenes made by hand.

#include <gtest/gtest.h>

#include <numeric>

#include "precompute/import/import_gltf.h"
#include "precompute/patches/winding.h"
#include "tests/support/shared_folder.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_winding {
namespace {

constexpr bool kInwards = true, kOutwards = false;

// The triangles of all pieces, ascending.
std::vector<std::uint32_t> turned(const Scene& scene) {
  std::vector<std::uint32_t> triangles;
  for (const InsideOutPiece& piece : find_inside_out(scene)) {
    triangles.insert(triangles.end(), piece.triangle.begin(), piece.triangle.end());
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

std::vector<std::uint32_t> range(std::uint32_t begin, std::uint32_t end) {
  std::vector<std::uint32_t> numbers(end - begin);
  std::iota(numbers.begin(), numbers.end(), begin);
  return numbers;
}

// A room of 12 triangles with two boxes of 12 on its floor.
Scene furnished_room(bool room, bool furniture) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, room);
  test::add_box(scene, {0.5, 0, 0.5}, {1.5, 1, 1.5}, furniture);
  test::add_box(scene, {3, 0, 2}, {4, 2, 3}, furniture);
  return scene;
}

// Turns a triangle over.
void flip(Scene& scene, std::uint32_t t) {
  std::swap(scene.triangle[t][1], scene.triangle[t][2]);
}

TEST(Winding, RoomWithClosedSolidsIsRight) {
  EXPECT_TRUE(find_inside_out(furnished_room(kInwards, kOutwards)).empty());
}

TEST(Winding, EmptyRoomIsRight) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, kInwards);
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, RoomThatFacesOutwardsIsFoundAndItsFurnitureIsNot) {
  const Scene scene = furnished_room(kOutwards, kOutwards);
  EXPECT_EQ(turned(scene), range(0, 12));
  const auto pieces = find_inside_out(scene);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_NEAR(pieces[0].area, 94, 1e-4);
  EXPECT_EQ(pieces[0].front_share, 0);
  EXPECT_GT(pieces[0].back_coverage, 0.1);
}

TEST(Winding, EmptyRoomThatFacesOutwardsIsFound) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, kOutwards);
  EXPECT_EQ(turned(scene), range(0, 12));
}

TEST(Winding, SolidThatFacesInwardsIsFound) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {5, 3, 4}, kInwards);
  test::add_box(scene, {2, 1, 1}, {3, 2, 2}, kInwards);
  EXPECT_EQ(turned(scene), range(12, 24));
}

TEST(Winding, WallThatWasTurnedOverIsAPieceOfItsOwn) {
  Scene scene = furnished_room(kInwards, kOutwards);
  flip(scene, 6);
  flip(scene, 7);
  EXPECT_EQ(turned(scene), range(6, 8));
}

TEST(Winding, OuterShellOfARoomIsRight) {
  Scene scene = furnished_room(kInwards, kOutwards);
  test::add_box(scene, {-0.2, -0.2, -0.2}, {5.2, 3.2, 4.2}, kOutwards);
  const std::vector<glm::dvec3> ground{{-20, -1, 20}, {20, -1, 20}, {20, -1, -20}, {-20, -1, -20}};
  test::add_polygon(scene, ground);
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, PosterOnAWallIsRight) {
  Scene scene = furnished_room(kInwards, kOutwards);
  const std::vector<glm::dvec3> poster{{1, 1, 0.001}, {2, 1, 0.001}, {2, 2, 0.001}, {1, 2, 0.001}};
  test::add_polygon(scene, poster);
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, SolidWithoutABottomIsRight) {
  Scene scene = furnished_room(kInwards, kOutwards);
  test::remove_face(scene, test::Face::kLowY, 1);
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, SecondSidesThatAreCopiesAreRight) {
  Scene scene = furnished_room(kInwards, kOutwards);
  for (std::uint32_t t = 0; t < 12; ++t) {
    scene.triangle.push_back(scene.triangle[t]);
    scene.triangle_material.push_back(0);
    flip(scene, static_cast<std::uint32_t>(scene.triangle.size() - 1));
  }
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, DoubleSidedSurfacesAreRight) {
  Scene scene = furnished_room(kOutwards, kInwards);
  scene.materials[0].double_sided = true;
  EXPECT_TRUE(find_inside_out(scene).empty());
}

TEST(Winding, IsTheSameEveryTime) {
  const Scene scene = furnished_room(kOutwards, kOutwards);
  const auto first = find_inside_out(scene);
  const auto second = find_inside_out(scene);
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(first[0].triangle, second[0].triangle);
  EXPECT_EQ(first[0].back_coverage, second[0].back_coverage);
}

TEST(Winding, OnlyTheTurnedTrianglesBecomeDoubleSided) {
  Scene scene = furnished_room(kOutwards, kOutwards);
  make_double_sided(scene, find_inside_out(scene));
  ASSERT_EQ(scene.materials.size(), 2U);
  EXPECT_FALSE(scene.materials[0].double_sided);
  EXPECT_TRUE(scene.materials[1].double_sided);
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    EXPECT_EQ(scene.triangle_material[t], t < 12 ? 1U : 0U);
  }
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_TRUE(scene.warnings[0].starts_with("12 triangles")) << scene.warnings[0];
  EXPECT_TRUE(find_inside_out(scene).empty());
}

/// Of the scenes that people made, the breakfast room alone has such pieces: the rubber feet of its
/// chairs, which enclose a negative volume.
TEST(Winding, ScenesThatPeopleMadeAreRight) {
  const auto folder = test::shared_folder() / "scenes";
  REBOUNCE_NEED_SHARED(folder);
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".glb") continue;
    SCOPED_TRACE(entry.path().filename().string());
    const auto pieces = find_inside_out(import_gltf(entry.path()));
    const bool is_breakfast_room = entry.path().filename() == "16_breakfast_room.glb";
    EXPECT_EQ(pieces.size(), is_breakfast_room ? 4U : 0U);
    for (const InsideOutPiece& piece : pieces) EXPECT_LT(piece.area, 0.01);
    ++scenes;
  }
  EXPECT_GE(scenes, 15);
}

}  // namespace
}  // namespace rebounce::test_winding
