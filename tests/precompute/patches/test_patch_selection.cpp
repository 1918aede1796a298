#include "precompute/patches/patch_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "precompute/patches/winding.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_patch_selection {
namespace {

/// Two walls, of which the second is placed twice, and a lamp.
Scene named_scene() {
  Scene scene = test::empty_scene();
  scene.materials[0].name = "paint";
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].name = "lamp";
  scene.materials[1].emitted_luminance = {5, 5, 5};
  const auto add_wall = [&](double x, std::uint32_t material, std::uint32_t mesh) {
    const glm::dvec3 corner[] = {{x, 0, 0}, {x, 1, 0}, {x, 1, 1}, {x, 0, 1}};
    test::add_polygon(scene, corner, material);
    scene.triangle_mesh.resize(scene.triangle.size(), mesh);
  };
  scene.placed_meshes = {{"wall", "left"}, {"panel", "middle"}, {"panel", "right"}, {"", "lamp\n"}};
  add_wall(0, 0, 0);
  add_wall(1, 0, 1);
  add_wall(2, 0, 2);
  add_wall(3, 1, 3);
  return scene;
}

/// The x of the patches that a list selects, each once.
std::vector<float> selected_x(const std::string& list) {
  const Scene scene = named_scene();
  const PatchModel model = make_patch_model(scene, {.patch_count = 40});
  const PatchSelection selection(split_selection(list), scene, "receivers");
  const std::vector<std::uint8_t> selected = selection.patches(model);
  std::vector<float> x;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (selected[i] != 0) x.push_back(std::round(model.patches.centroid[i][0]));
  }
  std::ranges::sort(x);
  x.erase(std::unique(x.begin(), x.end()), x.end());
  return x;
}

TEST(PatchSelection, FindsMeshesNodesMaterialsAndBoxes) {
  using X = std::vector<float>;
  EXPECT_EQ(selected_x("wall"), X{0});
  EXPECT_EQ(selected_x("panel"), (X{1, 2}));
  EXPECT_EQ(selected_x("mesh:right,left"), (X{0, 2}));
  EXPECT_EQ(selected_x("paint"), (X{0, 1, 2}));
  EXPECT_EQ(selected_x("material:lamp"), X{3});
  EXPECT_EQ(selected_x("box:0.5,-1,-1,1.5,2,2"), X{1});
  EXPECT_EQ(selected_x("wall,box:1.5,2,2,2.5,-1,-1,lamp"), (X{0, 2, 3}));
}

TEST(PatchSelection, SaysWhatIsWrong) {
  const auto attempt = [](const std::string& list) { return [list] { selected_x(list); }; };
  test::expect_error(attempt("pannel"), R"(receivers: the scene has no mesh or material "pannel"; )"
                                        R"(there are "panel", "paint")");
  test::expect_error(attempt("mesh:paint"), R"(has no mesh "paint")");
  test::expect_error(attempt("material:wall"), R"(has no material "wall"; there are )");
  test::expect_error(attempt(""), "has no mesh or material \"\"");
  test::expect_error(attempt("a\nb"), R"("a\nb")");
  for (const std::string box : {"box:", "box:1,2,3", "box:1,2,3,4,5,x", "box:1,2,3,4,5,6x",
                                "box:1,2,3,4,5,nan", "box:1;2;3;4;5;6", "box:1,2,3,4,5,"}) {
    test::expect_error(attempt(box), "is not a box");
  }
  test::expect_error(attempt("box:10,10,10,11,11,11"), "the named surfaces have no patches");
}

TEST(PatchSelection, WhatEmitsIsASource) {
  const Scene scene = named_scene();
  const PatchModel model = make_patch_model(scene, {.patch_count = 40});
  const PatchSelection wall(std::vector<std::string>{"wall"}, scene, "sources");
  const PatchRoles roles = choose_roles(model, {}, wall);
  for (std::size_t i = 0; i < roles.role.size(); ++i) {
    const float x = std::round(model.patches.centroid[i][0]);
    EXPECT_TRUE(roles.is_receiver(i));
    EXPECT_EQ(roles.is_source(i), x == 0 || x == 3) << x;
  }
  EXPECT_TRUE(choose_roles(model, {}, {}).all_are_both());
}

TEST(PatchSelection, MeshesAreKnownAfterTheirTrianglesAreCut) {
  const Scene scene = import_usable(REBOUNCE_SOURCE_DIR "/tests/scenes/two_rooms.gltf", 1);
  ASSERT_EQ(scene.triangle_mesh.size(), scene.triangle.size());
  ASSERT_EQ(scene.placed_meshes.size(), 8U);
  const PatchModel model = make_patch_model(scene, {.patch_count = 400});
  ASSERT_EQ(model.triangle_mesh.size(), model.mesh.triangle.size());
  const PatchSelection floor(std::vector<std::string>{"mesh:floor"}, scene, "receivers");
  const std::vector<std::uint8_t> selected = floor.patches(model);
  double area = 0;
  for (std::size_t i = 0; i < selected.size(); ++i) {
    if (selected[i] == 0) continue;
    EXPECT_NEAR(model.patches.centroid[i][1], 0, 1e-3);
    EXPECT_GT(model.patches.normal[i][1], 0.99F);
    area += model.patches.area[i];
  }
  EXPECT_GT(area, 10);
}

TEST(WantedPart, CountsPairsThatWantLightBothWaysOnce) {
  constexpr std::uint8_t kNeither = 0, kReceiver = PatchRoles::kReceiver,
                         kSource = PatchRoles::kSource, kBoth = PatchRoles::kBoth;
  EXPECT_EQ(wanted_part({}, 4), 1);
  EXPECT_EQ(wanted_part({{kBoth, kBoth, kBoth, kBoth}}, 4), 1);
  EXPECT_NEAR(wanted_part({{kReceiver, kReceiver, kSource, kSource}}, 4), 0.5, 1e-12)
      << "from one half to the other";
  EXPECT_NEAR(wanted_part({{kBoth, kBoth, kSource, kSource}}, 4), 0.75, 1e-12);
  EXPECT_NEAR(wanted_part({{kBoth, kNeither, kNeither, kNeither}}, 4), 1.0 / 16, 1e-12);
}

}  // namespace
}  // namespace rebounce::test_patch_selection
