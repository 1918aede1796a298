// What the viewer is made of besides OpenGL: motions, camera, key light, methods.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "rebounce/error.h"
#include "runtime/demo/motion/fly_camera.h"
#include "runtime/demo/motion/indirect_solver.h"
#include "runtime/demo/motion/light_motion.h"
#include "runtime/demo/picture/camera.h"
#include "runtime/demo/picture/key_light.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/demo/shading/patch_errors.h"
#include "runtime/rays/float3_glm.h"
#include "tests/support/test_scene_data.h"
#include "transfer/base/area_norm.h"

namespace rebounce::test_viewer_parts {
namespace {

float distance(const Float3& a, const Float3& b) {
  return glm::distance(to_glm(a), to_glm(b));
}

TEST(LightMotion, CirclesAtEvenSpeed) {
  const LightMotion motion{.kind = LightMotion::Kind::kCircle,
                           .period = 8,
                           .center = {1, 2, 3},
                           .axis = {0, 2, 0},
                           .radius = 0.5F};
  const Light light;
  const Float3 begin = moved(light, motion, 0).position;
  for (int k = 0; k < 8; ++k) {
    const Float3 here = moved(light, motion, static_cast<float>(k)).position;
    const Float3 next = moved(light, motion, static_cast<float>(k + 1)).position;
    EXPECT_NEAR(distance(here, motion.center), 0.5F, 1e-6F);
    EXPECT_EQ(here[1], 2);
    EXPECT_NEAR(distance(here, next), std::sin(std::numbers::pi / 8), 1e-5);  // a chord
  }
  EXPECT_LT(distance(moved(light, motion, 8).position, begin), 1e-5F);
}

TEST(LightMotion, SwingsBetweenItsEnds) {
  const LightMotion motion{
      .kind = LightMotion::Kind::kSwing, .period = 2, .from = {-1, 0, 0}, .to = {1, 0, 0}};
  const Light light;
  EXPECT_LT(distance(moved(light, motion, 0).position, motion.from), 1e-6F);
  EXPECT_LT(distance(moved(light, motion, 0.5F).position, {0, 0, 0}), 1e-6F);
  EXPECT_LT(distance(moved(light, motion, 1).position, motion.to), 1e-6F);
  EXPECT_LT(distance(moved(light, motion, 2).position, motion.from), 1e-6F);
}

TEST(LightMotion, FollowsItsKeysAndBeginsAgain) {
  LightMotion motion{.kind = LightMotion::Kind::kKeys};
  motion.keys = {{.time = 0, .position = {0, 0, 0}, .intensity = 10},
                 {.time = 1, .position = {2, 0, 0}, .intensity = 20},
                 {.time = 3, .position = {2, 4, 0}, .color = {0, 0, 0}, .intensity = 20}};
  const Light light;
  EXPECT_EQ(moved(light, motion, 0.5F).position, (Float3{1, 0, 0}));
  EXPECT_EQ(moved(light, motion, 0.5F).intensity, 15);
  EXPECT_EQ(moved(light, motion, 2).position, (Float3{2, 2, 0}));
  EXPECT_EQ(moved(light, motion, 2).color, (Float3{0.5F, 0.5F, 0.5F}));
  EXPECT_EQ(moved(light, motion, 3.5F).position, (Float3{1, 0, 0}));
  motion.keys.resize(1);
  EXPECT_EQ(moved(light, motion, 7).position, (Float3{0, 0, 0}));
}

TEST(LightMotion, LeavesStillLampsAlone) {
  Light light;
  light.position = {1, 2, 3};
  EXPECT_EQ(moved(light, {}, 5).position, light.position);
}

TEST(FlyCamera, BeginsAsTheCameraItIsGiven) {
  const Camera camera = look_at({1, 2, 3}, {4, 1, -2}, 0.9F);
  const Camera same = FlyCamera(camera).camera();
  EXPECT_EQ(same.position, camera.position);
  EXPECT_EQ(same.vertical_fov, camera.vertical_fov);
  EXPECT_LT(distance(same.right, camera.right), 1e-5F);
  EXPECT_LT(distance(same.up, camera.up), 1e-5F);
  EXPECT_LT(distance(same.backward, camera.backward), 1e-5F);
}

TEST(FlyCamera, OrbitsAroundWhatStaysWhereItIsSeen) {
  FlyCamera camera(look_at({0, 1, 5}, {0, 1, 0}, 0.9F));
  const glm::vec3 target(0.5F, 1.5F, 1);
  const auto seen = [&] {
    const Camera now = camera.camera();
    const glm::vec3 way = target - camera.position();
    return glm::vec3(glm::dot(way, to_glm(now.right)), glm::dot(way, to_glm(now.up)),
                     glm::dot(way, to_glm(now.backward)));
  };
  const glm::vec3 before = seen();
  const glm::vec3 position = camera.position();
  camera.orbit(target, 0.7F, 0.3F);
  EXPECT_GT(glm::distance(camera.position(), position), 1);
  EXPECT_LT(glm::distance(seen(), before), 1e-4F);
}

TEST(FlyCamera, NeverTipsOver) {
  FlyCamera camera(look_at({0, 1, 5}, {0, 1, 0}, 0.9F));
  camera.turn(0, 10);
  EXPECT_GT(camera.camera().up[1], 0);
  camera.turn(0, -20);
  EXPECT_GT(camera.camera().up[1], 0);
}

// A floor and a ceiling, with even exchange and the operator of one bounce of it.
std::shared_ptr<TransferData> two_planes() {
  auto data = std::make_shared<TransferData>();
  test::add_square(*data, 1, 0, 3, true, {0.5F, 0.25F, 0.75F});
  test::add_square(*data, 1, 2, 3, false, {0.5F, 0.5F, 0.5F});
  test::add_even_exchange(*data);
  return data;
}

TEST(KeyLight, HangsInTheOpenAndReachesTheSurface) {
  const auto data = two_planes();
  const RayTracer tracer = make_surface_tracer(data->mesh);
  const Light light = make_key_light(*data, tracer);
  EXPECT_GT(light.position[1], 0.2F);
  EXPECT_LT(light.position[1], 1.8F);
  EXPECT_GT(light.intensity, 0);
  EXPECT_EQ(light.position, make_key_light(*data, tracer).position);
}

TEST(KeyLight, HangsUnderARoofAndNotAboveIt) {
  const auto data = two_planes();
  std::ranges::fill(data->patches.sky_visibility, 0.0F);
  test::add_square(*data, 1.5F, 2.1F, 3, true, {0.5F, 0.5F, 0.5F});  // the larger roof
  const RayTracer tracer = make_surface_tracer(data->mesh);
  const float height = make_key_light(*data, tracer).position[1];
  EXPECT_GT(height, 0);
  EXPECT_LT(height, 2);
}

std::vector<Float3> patterned(std::size_t n, float shift) {
  std::vector<Float3> values(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float x = 10 + 5 * std::sin(static_cast<float>(i) + shift);
    values[i] = {x, 2 * x, 0.5F * x};
  }
  return values;
}

TEST(IndirectSolver, GivesTheProductByDefault) {
  const auto data = two_planes();
  IndirectSolver solver(*data);
  const std::vector<Float3> exitance = patterned(data->patches.size(), 0);
  EXPECT_TRUE(std::ranges::equal(solver.solve(exitance), product(*data->transfer, exitance)));
}

TEST(IndirectSolver, ConvergesFromFrameToFrameOnlyIfWarm) {
  const auto data = two_planes();
  const std::vector<Float3> exitance = patterned(data->patches.size(), 0);
  IndirectSolver exact(*data), warm(*data), cold(*data);
  exact.choose({.iteration = SolveMethod::kGaussSeidel, .sweeps = 100, .warm = false});
  warm.choose({.iteration = SolveMethod::kGathering, .sweeps = 1, .warm = true});
  cold.choose({.iteration = SolveMethod::kGathering, .sweeps = 1, .warm = false});
  const auto truth = exact.solve(exitance);
  for (int frame = 0; frame < 40; ++frame) {
    warm.solve(exitance);
    cold.solve(exitance);
  }
  const auto& area = data->patches.area;
  EXPECT_LT(relative_difference(warm.solve(exitance), truth, area), 1e-5);
  EXPECT_GT(relative_difference(cold.solve(exitance), truth, area), 1e-2);
}

TEST(IndirectSolver, EveryIterationFindsTheSameLight) {
  const auto data = two_planes();
  const std::vector<Float3> exitance = patterned(data->patches.size(), 0);
  IndirectSolver exact(*data), other(*data);
  exact.choose({.iteration = SolveMethod::kGaussSeidel, .sweeps = 100, .warm = false});
  const auto truth = exact.solve(exitance);
  for (const NamedSolveMethod& named : kSolveMethods) {
    other.choose({.iteration = named.method, .sweeps = 100});
    EXPECT_LT(relative_difference(other.solve(exitance), truth, data->patches.area), 1e-4)
        << named.name;
  }
  EXPECT_THROW(other.choose({.on_links = true}), Error);  // there are none
}

TEST(IndirectSolver, ChangesNoMoreThanTheLightDid) {
  const auto data = two_planes();
  IndirectSolver solver(*data);
  solver.choose({.iteration = SolveMethod::kGaussSeidel, .sweeps = 100, .warm = true});
  const std::vector<Float3> before = patterned(data->patches.size(), 0);
  const std::vector<Float3> after = patterned(data->patches.size(), 0.01F);
  const auto largest_change = [](std::span<const Float3> a, std::span<const Float3> b) {
    float largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (int c = 0; c < kChannelCount; ++c) {
        largest = std::max(largest, std::abs(a[i][c] - b[i][c]));
      }
    }
    return largest;
  };
  const auto span = solver.solve(before);
  const std::vector<Float3> first(span.begin(), span.end());
  const auto second = solver.solve(after);
  // Rows of F add up to at most 1 and reflectances are at most 3/4: H changes by at most
  // 1 / (1 - 3/4) of what the exitance does.
  const float light_change = largest_change(before, after);
  EXPECT_GT(largest_change(first, second), 0);
  EXPECT_LE(largest_change(first, second), 4 * light_change);
}

TEST(PatchErrors, ArePartsOfTheRootMeanSquare) {
  const std::vector<Float3> reference = {{3, 0, 0}, {0, 4, 0}};
  const std::vector<Float3> values = {{3, 0, 0}, {0, 4, 2.5F}};
  const std::array<float, 2> area = {1, 1};
  const std::vector<float> error = patch_errors(values, reference, area);
  EXPECT_EQ(error[0], 0);
  EXPECT_NEAR(error[1], 2.5 / std::sqrt(12.5), 1e-6);
}

}  // namespace
}  // namespace rebounce::test_viewer_parts
