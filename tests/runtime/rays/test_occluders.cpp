#include "runtime/rays/occluders.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "runtime/rays/ray_tracer.h"
#include "tests/runtime/rays/occluder_samples.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_occluders {
namespace {

constexpr unsigned kSeed = 5;
constexpr std::size_t kAll = 100000;

double area(const Occluder& piece) {
  const auto& [a, b, c, d] = piece.corner;
  return 0.5 * (glm::length(glm::cross(b - a, c - a)) + glm::length(glm::cross(c - a, d - a)));
}

double area(const Occluders& occluders) {
  double sum = 0;
  for (const Occluder& piece : occluders.piece) sum += area(piece);
  return sum;
}

double area(const TransferData& data) {
  double sum = 0;
  for (const float a : data.patches.area) sum += a;
  return sum;
}

TEST(Occluders, FacesOfBoxesBecomeOnePieceEach) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = test::furnished_box(engine, 5);
  const Occluders occluders = find_occluders(data.mesh, kAll, kAll);
  EXPECT_TRUE(occluders.is_whole);
  EXPECT_EQ(occluders.piece.size(), 36U);
  EXPECT_NEAR(area(occluders), area(data), 1e-4 * area(data));
}

TEST(Occluders, HolesStayOpen) {
  // A wall of 5 x 5 squares without the one in the middle.
  TransferData data;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      if (i == 2 && j == 2) continue;
      const glm::vec3 corner(static_cast<float>(i), static_cast<float>(j), 0);
      test::add_parallelogram(data, corner, {1, 0, 0}, {0, 1, 0}, 1);
    }
  }
  const Occluders occluders = find_occluders(data.mesh, kAll, kAll);
  EXPECT_EQ(occluders.piece.size(), 4U);
  EXPECT_NEAR(area(occluders), 24, 1e-4);
  for (const Occluder& piece : occluders.piece) {
    EXPECT_FALSE(test::crosses(piece, {2.5F, 2.5F, -1}, {2.5F, 2.5F, 1}));
  }
}

/// A disc of `sides` triangles around the origin.
TransferData disc(int sides) {
  TransferData data;
  const auto at = [&](int k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k % sides) / sides;
    return glm::vec3(std::cos(angle), std::sin(angle), 0);
  };
  for (int k = 0; k < sides; ++k) {
    test::add_patch(data, {0, 0, 0}, at(k), at(k + 1), {0.5F, 0.5F, 0.5F});
  }
  return data;
}

TEST(Occluders, RoundSurfacesOfManySidesAreLeftToRays) {
  const TransferData small = disc(100), large = disc(3000);
  const Occluders whole = find_occluders(small.mesh, kAll, kAll);
  EXPECT_TRUE(whole.is_whole);
  EXPECT_NEAR(area(whole), area(small), 1e-4 * area(small));
  const Occluders part = find_occluders(large.mesh, kAll, kAll);
  EXPECT_FALSE(part.is_whole);
  EXPECT_LE(area(part), 1.0001 * area(large));
}

TEST(Occluders, SliversThatUndoEachOtherAreLeftOut) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<float> uniform(0.5F, 1);
  const Float3 grey{0.5F, 0.5F, 0.5F};
  int undone = 0;
  for (int k = 0; k < 100; ++k) {
    // The sign of their area is rounding.
    const glm::vec3 a(0), c(uniform(engine), uniform(engine), 0);
    const glm::vec3 b = std::ldexp(1.0F, -40) * glm::vec3(std::nextafter(c.x, 2.0F), c.y, 0);
    TransferData data;
    test::add_patch(data, a, b, c, grey);
    test::add_patch(data, c, b, a, grey);
    const Occluders occluders = find_occluders(data.mesh, kAll, kAll);
    EXPECT_LT(area(occluders), 1e-6);
    if (occluders.piece.empty()) ++undone;
  }
  EXPECT_GT(undone, 0) << "nothing was tried";
}

TEST(Occluders, StopTheSameRaysAsTheTriangles) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = test::furnished_box(engine, 20);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const Occluders occluders = find_occluders(data.mesh, kAll, kAll);
  std::uniform_real_distribution<float> uniform(-1.4F, 1.4F);
  const auto any = [&] { return glm::vec3(uniform(engine), uniform(engine), uniform(engine)); };
  constexpr int kRays = 10000;
  int stopped = 0, different = 0;
  for (int k = 0; k < kRays; ++k) {
    const glm::vec3 a = any(), b = any();
    std::vector<Ray> ray(1);
    ray[0].origin = to_float3(a);
    ray[0].t_near = 0;
    ray[0].direction = to_float3(b - a);
    ray[0].t_far = 1;
    tracer.occluded(ray);
    const bool crossed = std::ranges::any_of(
        occluders.piece, [&](const Occluder& piece) { return test::crosses(piece, a, b); });
    stopped += crossed ? 1 : 0;
    different += crossed != is_occluded(ray[0]) ? 1 : 0;
  }
  EXPECT_GT(stopped, kRays / 5);
  EXPECT_LT(stopped, 4 * kRays / 5);
  EXPECT_LE(different, 1);  // a ray along an edge may go either way
}

TEST(Occluders, OfManyTheLargestAreTaken) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  const TransferData data = test::furnished_box(engine, 20);
  const Occluders some = find_occluders(data.mesh, 100, 6);
  EXPECT_FALSE(some.is_whole);
  EXPECT_EQ(some.piece.size(), 6U);
  EXPECT_NEAR(area(some), 2 * (4 * 3 + 4 * 4 + 3 * 4), 1e-3);  // the walls
}

TEST(Occluders, TrianglesWithHolesAreNotJoined) {
  TransferData data;
  test::add_parallelogram(data, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1);
  data.mesh.opacity.triangle_map = {0, kNone};
  data.mesh.opacity.begin = {0, 1};
  data.mesh.opacity.opacity = {100};
  const Occluders occluders = find_occluders(data.mesh, kAll, kAll);
  ASSERT_EQ(occluders.piece.size(), 2U);
  EXPECT_NE(occluders.piece[0].solid, occluders.piece[1].solid);
}

}  // namespace
}  // namespace rebounce::test_occluders
