// The view of a scene without a camera: what it sees, and what it does not depend on.

#include "runtime/demo/picture/default_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/candidate_view.h"
#include "runtime/demo/picture/view_score.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/rectangle_scene.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_default_view {
namespace {

using test::SceneBuilder;

// A side of a box, by its axis and whether it is the upper one. Each is cut into `cuts` x `cuts`.
void add_side(SceneBuilder& scene, const Box& box, int axis, bool upper, bool inwards,
              std::uint32_t material, int cuts) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (int cell = 0; cell < cuts * cuts; ++cell) {
    std::array<Float3, 4> corner;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto part = [&](int at, bool far) {
        return static_cast<float>(at + (far ? 1 : 0)) / static_cast<float>(cuts);
      };
      glm::vec3 p;
      p[axis] = upper ? box.high[axis] : box.low[axis];
      p[u] = glm::mix(box.low[u], box.high[u], part(cell % cuts, k == 1 || k == 2));
      p[v] = glm::mix(box.low[v], box.high[v], part(cell / cuts, k >= 2));
      corner[k] = to_float3(p);
    }
    if (upper == inwards) std::swap(corner[1], corner[3]);
    scene.add_rectangle(corner, material);
  }
}

struct BoxOptions {
  bool inwards = false;
  int open_axis = -1;  ///< its upper side is left out
  int cuts = 1;
};

void add_box(SceneBuilder& scene, const glm::vec3& low, const glm::vec3& high,
             std::uint32_t material, const BoxOptions& options = {}) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upper : {false, true}) {
      if (upper && axis == options.open_axis) continue;
      add_side(scene, {low, high}, axis, upper, options.inwards, material, options.cuts);
    }
  }
}

// A room of 6 x 2.8 x 5 m times `scale` with a table and a cupboard.
void add_room(SceneBuilder& scene, const glm::vec3& at, float scale, BoxOptions options = {}) {
  const std::uint32_t wall = scene.add_material({0.7F, 0.7F, 0.7F});
  const std::uint32_t wood = scene.add_material({0.5F, 0.3F, 0.2F});
  options.inwards = true;
  const auto place = [&](float x, float y, float z) { return at + scale * glm::vec3(x, y, z); };
  add_box(scene, place(0, 0, 0), place(6, 2.8F, 5), wall, options);
  const BoxOptions closed{.cuts = options.cuts};
  add_box(scene, place(2.5F, 0, 2), place(3.5F, 0.75F, 3), wood, closed);
  add_box(scene, place(0.1F, 0, 0.1F), place(0.6F, 2, 1.6F), wood, closed);
}

SceneBuilder room(float scale = 1, const BoxOptions& options = {}) {
  SceneBuilder scene;
  add_room(scene, glm::vec3(0), scale, options);
  return scene;
}

Camera view_of(SceneBuilder& scene) {
  const DisplayMesh& mesh = scene.data().mesh;
  return default_view(mesh, make_surface_tracer(mesh));
}

// The picture's half height at the point's depth is 1; behind the camera nothing is seen.
bool is_in_picture(const Camera& camera, const glm::vec3& point) {
  const glm::vec3 way = point - to_glm(camera.position);
  const float depth = -glm::dot(way, to_glm(camera.backward));
  const float half = depth * std::tan(0.5F * camera.vertical_fov);
  return depth > 0 && std::abs(glm::dot(way, to_glm(camera.up))) <= half &&
         std::abs(glm::dot(way, to_glm(camera.right))) <= kViewAspect * half;
}

void expect_same_view(const Camera& a, const Camera& b, float most) {
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(a.position[k], b.position[k], most);
    EXPECT_NEAR(a.backward[k], b.backward[k], most);
  }
}

TEST(DefaultView, StandsInAClosedRoomAtEyeHeight) {
  for (const bool double_sided : {false, true}) {
    SceneBuilder scene = room();
    if (double_sided) scene.make_double_sided();
    const Camera camera = view_of(scene);
    EXPECT_NEAR(camera.position[1], 1.6F, 1e-4F) << "on the floor, not on the table";
    EXPECT_GT(std::min(camera.position[0], 6 - camera.position[0]), 0.2F);
    EXPECT_GT(std::min(camera.position[2], 5 - camera.position[2]), 0.2F);
    EXPECT_EQ(camera.up, (Float3{0, 1, 0})) << "level";
    EXPECT_TRUE(is_in_picture(camera, {3, 0.75F, 2.5F})) << "the table";
    EXPECT_TRUE(is_in_picture(camera, {0.4F, 1.5F, 1})) << "the cupboard";
  }
}

TEST(DefaultView, DoesNotDependOnHowSurfaceIsDivided) {
  SceneBuilder coarse = room(), fine = room(1, {.cuts = 7});
  EXPECT_GT(fine.patch_count(), 40 * coarse.patch_count());
  expect_same_view(view_of(coarse), view_of(fine), 1e-3F);
}

TEST(DefaultView, FindsTheRoomOnWideGround) {
  SceneBuilder scene;
  const glm::vec3 at(37, 0, -21);
  add_room(scene, at, 1, {.cuts = 8});
  scene.add_rectangle(test::floor_corners(200), scene.add_material({0.2F, 0.4F, 0.2F}));
  scene.make_double_sided();
  const glm::vec3 inside = to_glm(view_of(scene).position) - at;
  EXPECT_TRUE(glm::all(glm::greaterThan(inside, glm::vec3(0)))) << inside.x << ' ' << inside.z;
  EXPECT_TRUE(glm::all(glm::lessThan(inside, glm::vec3(6, 2.8F, 5))))
      << inside.x << ' ' << inside.z;
}

// A Cornell box in any unit: the whole inside through its open side.
TEST(DefaultView, LooksIntoAnOpenBoxFromItsOpenSide) {
  for (const float side : {0.05F, 3.0F, 500.0F}) {
    SceneBuilder scene;
    const std::uint32_t wall = scene.add_material({0.7F, 0.7F, 0.7F});
    add_box(scene, glm::vec3(0), glm::vec3(side), wall, {.inwards = true, .open_axis = 2});
    add_box(scene, side * glm::vec3(0.1F, 0, 0.2F), side * glm::vec3(0.4F, 0.6F, 0.5F), wall);
    const Camera camera = view_of(scene);
    EXPECT_GT(camera.position[2], side);
    EXPECT_GT(camera.backward[2], 0.7F);
    EXPECT_TRUE(is_in_picture(camera, {0, 0, 0}));
    EXPECT_TRUE(is_in_picture(camera, {side, side, 0}));
  }
}

TEST(DefaultView, ShowsAnObjectWholeFromAroundIt) {
  for (const float scale : {0.02F, 1.0F, 30.0F}) {
    SceneBuilder scene;
    const glm::vec3 high = scale * glm::vec3(1, 0.5F, 3);
    add_box(scene, glm::vec3(0), high, scene.add_material({0.5F, 0.5F, 0.5F}));
    const Camera camera = view_of(scene);
    for (int k = 0; k < 8; ++k) {
      EXPECT_TRUE(is_in_picture(camera, {(k & 1) != 0 ? high.x : 0, (k & 2) != 0 ? high.y : 0,
                                         (k & 4) != 0 ? high.z : 0}));
    }
    EXPECT_GT(camera.position[1], high.y) << "three sides are seen";
    EXPECT_LT(camera.backward[1], 0.9F);
  }
}

TEST(DefaultView, IsTheSameForAnyNumberOfThreads) {
  SceneBuilder scene = room();
  const auto view = [&] { return view_of(scene); };
  expect_same_view(test::with_threads(1, view), test::with_threads(2, view), 0);
}

TEST(DefaultView, HasAnswersForScenesThatAreHardlyAny) {
  SceneBuilder empty, flat;
  EXPECT_GT(view_of(empty).vertical_fov, 0);
  flat.add_rectangle(test::floor_corners(1), flat.add_material({1, 1, 1}));
  EXPECT_GT(view_of(flat).position[1], 0);
}

TEST(DefaultCamera, IsTheFirstOfTheScene) {
  SceneBuilder scene = room();
  const RayTracer tracer = make_surface_tracer(scene.data().mesh);
  expect_same_view(default_camera(scene.data(), tracer), view_of(scene), 0);
  scene.data().cameras = {look_at({1, 1, 1}, {2, 2, 2}, 1), look_at({3, 1, 1}, {2, 2, 2}, 1)};
  expect_same_view(default_camera(scene.data(), tracer), scene.data().cameras[0], 0);
}

TEST(ViewScore, IsHigherTheMoreIsSeen) {
  SceneBuilder scene = room();
  const DisplayMesh& mesh = scene.data().mesh;
  const RayTracer tracer = make_surface_tracer(mesh);
  const auto score = [&](const Float3& from, const Float3& to) {
    return view_score(look_at(from, to, 1), mesh, tracer, 1.6F, 32, 24);
  };
  const float whole = score({5.5F, 1.6F, 4.5F}, {0, 1.6F, 0});
  EXPECT_GT(whole, score({5.5F, 1.6F, 4.5F}, {5.5F, 1.6F, 5})) << "a wall before the nose";
  EXPECT_GT(whole, score({3, 1.6F, 4.5F}, {6, 1.6F, 4.5F})) << "a bare wall";
  EXPECT_GT(whole, score({12, 1.6F, 2.5F}, {0, 1.6F, 2.5F})) << "through a culled wall";
  EXPECT_NEAR(score({3, 9, 2}, {3, 19, 2}), 0, 1e-6F) << "nothing";
}

}  // namespace
}  // namespace rebounce::test_default_view
