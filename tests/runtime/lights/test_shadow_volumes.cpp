#include "runtime/lights/shadow_volumes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/runtime/rays/occluder_samples.h"
#include "tests/support/test_scene_data.h"

namespace rebounce::test_shadow_volumes {
namespace {

constexpr unsigned kSeed = 3;

glm::vec3 any_point(std::mt19937& engine, float size) {
  std::uniform_real_distribution<float> uniform(-size, size);
  const float x = uniform(engine), y = uniform(engine);
  return {x, y, uniform(engine)};
}

/// A rectangle, or half of it.
Occluder any_occluder(std::mt19937& engine, bool triangle) {
  const glm::vec3 x = any_point(engine, 1), middle = any_point(engine, 1);
  const glm::vec3 normal = glm::normalize(glm::cross(x, any_point(engine, 1)));
  const glm::vec3 y = 0.7F * glm::cross(normal, x);
  const glm::vec3 last = triangle ? middle + x + y : middle - x + y;
  return {.corner = {middle - x - y, middle + x - y, middle + x + y, last},
          .normal = normal,
          .solid = true};
}

/// How far inside of a volume a point is.
float depth(const VolumePlanes& volume, const glm::vec3& p) {
  float least = std::numeric_limits<float>::max();
  for (const auto& [x, y, z, distance] : volume.plane) {
    if (x == 0 && y == 0 && z == 0 && distance == 0) continue;  // a side without length
    least = std::min(least, x * p.x + y * p.y + z * p.z - distance);
  }
  return least;
}

/// Places all over the surface of a lamp, or the one that it has.
std::vector<glm::vec3> places_of(const PreparedLight& lamp, const glm::vec3& from) {
  if (!lamp.kind->has_place()) return {from - 100.0F * lamp.direction};
  if (!lamp.has_area()) return {lamp.position};
  std::vector<glm::vec3> places;
  constexpr std::uint32_t kPlaces = 64;
  for (std::uint32_t k = 0; k < kPlaces; ++k) {
    places.push_back(lamp.position + lamp.kind->surface->place(lamp, k, kPlaces));
  }
  return places;
}

TEST(ShadowVolumes, TellWhatOfALampAnOccluderHides) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  constexpr float kEdge = 1e-4F;  // metres from a plane within which rounding may decide
  for (const LampKind* kind : lamp_kinds()) {
    int free = 0, hidden = 0, partly = 0;
    for (int k = 0; k < 500; ++k) {
      const Occluder occluder = any_occluder(engine, k % 2 == 0);
      const PreparedLight lamp(test::lamp_in_box(engine, kind->type));
      const OccluderGroups groups(Occluders{.piece = {occluder}});
      ShadowVolumes volumes(1);
      volumes.set(lamp, groups.group, 1e-5F);
      for (int i = 0; i < 20; ++i) {
        const glm::vec3 p = any_point(engine, 2);
        const float outer = depth(volumes.outer()[0], p), inner = depth(volumes.inner()[0], p);
        const std::vector<glm::vec3> places = places_of(lamp, p);
        const auto crossed = static_cast<std::size_t>(std::ranges::count_if(
            places, [&](const glm::vec3& place) { return test::crosses(occluder, p, place); }));
        if (outer < -kEdge) {
          EXPECT_EQ(crossed, 0U) << kind->name;
          ++free;
        } else if (inner > kEdge) {
          EXPECT_EQ(crossed, places.size()) << kind->name;
          ++hidden;
        } else {
          ++partly;
        }
      }
    }
    EXPECT_GT(free, 5000) << kind->name;
    EXPECT_GT(hidden, 100) << kind->name;
    // Without a surface a lamp is seen or hidden; only those too near a plane are left.
    if (kind->surface == nullptr) {
      EXPECT_LT(partly, 30) << kind->name;
    }
  }
}

TEST(ShadowVolumes, ALampThatTouchesASurfaceShinesPastIt) {
  const Occluder ceiling{.corner = {glm::vec3(-1, 1, -1), {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}},
                         .normal = {0, -1, 0},
                         .solid = true};
  Light panel;
  panel.type = LightType::kRectangle;
  panel.position = {0, 1, 0};
  panel.direction = {0, -1, 0};
  panel.tangent = {1, 0, 0};
  panel.size = {0.5F, 0.5F};
  ShadowVolumes volumes(1);
  volumes.set(PreparedLight(panel), OccluderGroups(Occluders{.piece = {ceiling}}).group, 1e-5F);
  EXPECT_LT(depth(volumes.outer()[0], {0.3F, 0, 0.2F}), 0);
}

TEST(ShadowVolumes, ALowSunIsKeptOffInAVastScene) {
  const Occluder roof{.corner = {glm::vec3(-1, 1, 1), {1, 1, 1}, {1, 1, -1}, {-1, 1, -1}},
                      .normal = {0, 1, 0},
                      .solid = true};
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = {std::sqrt(0.99F), -0.1F, 0};
  ShadowVolumes volumes(1);
  const float of_vast_scene = 0.19F;  // metres: 2^-18 of 50 km
  volumes.set(PreparedLight(sun), OccluderGroups(Occluders{.piece = {roof}}).group, of_vast_scene);
  EXPECT_GT(depth(volumes.inner()[0], {0.5F, 0.95F, 0}), 0.01F);
  EXPECT_LT(depth(volumes.outer()[0], {0.5F, 0.5F, 0}), 0);  // it comes in below the roof
}

TEST(ShadowVolumes, BoxesMeetWhatTheirPointsAreIn) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  int hidden = 0, apart = 0;
  for (int k = 0; k < 300; ++k) {
    Occluders occluders;
    for (int i = 0; i < 11; ++i) occluders.piece.push_back(any_occluder(engine, false));
    const OccluderGroups groups(occluders);
    ShadowVolumes volumes(groups.group.size());
    volumes.set(PreparedLight(test::lamp_in_box(engine, LightType::kSphere)), groups.group, 1e-5F);
    Box box;
    const glm::vec3 corner = any_point(engine, 2);
    box.add(corner);
    box.add(corner + 0.1F);
    std::array<ShadowVolumes::Number, 4> of_groups{};
    std::array<ShadowVolumes::Number, 16> number{};
    std::size_t group_count = 0, count = 0;
    ShadowVolumes::Between between = volumes.groups_between(box, of_groups, group_count);
    if (between == ShadowVolumes::Between::kSome) {
      between = volumes.between(box, std::span(of_groups).first(group_count), number, count);
    }
    ASSERT_NE(between, ShadowVolumes::Between::kMany);
    const auto named = std::span(number).first(count);
    for (const glm::vec3& p : {box.low, box.high, 0.5F * (box.low + box.high)}) {
      float inner = -1;
      for (ShadowVolumes::Number i = 0; i < occluders.piece.size(); ++i) {
        inner = std::max(inner, depth(volumes.inner()[i], p));
        if (between == ShadowVolumes::Between::kSome && depth(volumes.outer()[i], p) > 1e-4F) {
          EXPECT_NE(std::ranges::find(named, i), named.end());
        }
      }
      if (between == ShadowVolumes::Between::kHidden) {
        EXPECT_GT(inner, -1e-4F);
      }
    }
    hidden += between == ShadowVolumes::Between::kHidden ? 1 : 0;
    apart += between == ShadowVolumes::Between::kSome && count < occluders.piece.size() ? 1 : 0;
  }
  EXPECT_GT(hidden, 20);
  EXPECT_GT(apart, 100);
}

TEST(ShadowKernels, HidePlacesBehindPieces) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  constexpr std::size_t kPlaces = 3, kLanes = kShadowLanes;
  constexpr VolumeNumber kPieces = 2;
  const std::array<VolumeNumber, kPieces> numbers = {1, 0};
  // All points are inside of these.
  std::array<VolumePlanes, kPieces> everywhere{};
  for (VolumePlanes& volume : everywhere) {
    for (VolumePlanes::Plane& plane : volume.plane) plane = {0, 0, 0, -1};
  }
  int crossed = 0, free = 0;
  for (int round = 0; round < 300; ++round) {
    const Occluders occluders{.piece = {any_occluder(engine, true), any_occluder(engine, false)}};
    const OccluderGroups groups(occluders);
    std::array<std::array<float, kLanes>, 3> position{};
    std::array<std::array<std::array<float, kLanes>, 3>, kPlaces> path{};
    std::array<float, kLanes> open{};
    for (std::size_t e = 0; e < kLanes; ++e) {
      const glm::vec3 p = any_point(engine, 2);
      open[e] = 1;
      for (int axis = 0; axis < 3; ++axis) position[axis][e] = p[axis];
      for (auto& to_place : path) {
        const glm::vec3 way = any_point(engine, 2) - p;
        for (int axis = 0; axis < 3; ++axis) to_place[axis][e] = way[axis];
      }
    }
    for (const ShadowKernels* set : shadow_kernel_sets()) {
      std::array<std::array<float, kLanes>, kPlaces> hidden{};
      set->hide_places(everywhere.data(), groups.piece.data(), numbers.data(), kPieces,
                       position[0].data(), kLanes, open.data(), path[0][0].data(), kPlaces, 1,
                       hidden[0].data());
      for (std::size_t s = 0; s < kPlaces; ++s) {
        for (std::size_t e = 0; e < kLanes; ++e) {
          const glm::vec3 p(position[0][e], position[1][e], position[2][e]);
          const glm::vec3 place = p + glm::vec3(path[s][0][e], path[s][1][e], path[s][2][e]);
          const bool expected = std::ranges::any_of(occluders.piece, [&](const Occluder& occluder) {
            return test::crosses(occluder, p, place);
          });
          // With this seed no path is so near to a side that rounding decides.
          EXPECT_EQ(hidden[s][e] == 1, expected) << set->name;
          ++(expected ? crossed : free);
        }
      }
    }
    // What is closed is not looked at, nor what is outside of the volumes.
    std::array<std::array<float, kLanes>, kPlaces> hidden{};
    open.fill(0);
    shadow_kernels().hide_places(everywhere.data(), groups.piece.data(), numbers.data(), kPieces,
                                 position[0].data(), kLanes, open.data(), path[0][0].data(),
                                 kPlaces, 1, hidden[0].data());
    for (const auto& of_place : hidden) {
      EXPECT_TRUE(std::ranges::all_of(of_place, [](float h) { return h == 0; }));
    }
  }
  EXPECT_GT(crossed, 1000);
  EXPECT_GT(free, 1000);
}

TEST(ShadowKernels, InstructionSetsAgree) {
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto sets = shadow_kernel_sets();
  std::array<PlaneLanes, VolumePlanes::kPlanes> lanes{};
  std::array<VolumePlanes, 7> volumes{};
  constexpr std::array<VolumeNumber, 7> numbers = {3, 0, 6, 1, 5, 2, 4};
  std::array<std::array<float, kShadowLanes>, 3> points{};
  for (int round = 0; round < 100; ++round) {
    for (PlaneLanes& plane : lanes) {
      for (float* part : {plane.x, plane.y, plane.z, plane.distance}) {
        for (std::size_t k = 0; k < PlaneLanes::kLanes; ++k) part[k] = uniform(engine);
      }
    }
    for (VolumePlanes& volume : volumes) {
      for (auto& [x, y, z, distance] : volume.plane) {
        for (float* part : {&x, &y, &z, &distance}) *part = uniform(engine);
      }
    }
    for (auto& axis : points) {
      for (float& x : axis) x = uniform(engine);
    }
    const glm::vec3 middle = any_point(engine, 1), half = glm::abs(any_point(engine, 0.3F));
    std::array<float, kShadowLanes> expected{}, depth{};
    const float least = sets[0]->points_in_volumes(volumes.data(), numbers.data(), volumes.size(),
                                                   points[0].data(), kShadowLanes, expected.data());
    for (const ShadowKernels* set : sets) {
      EXPECT_NEAR(set->points_in_volumes(volumes.data(), numbers.data(), volumes.size(),
                                         points[0].data(), kShadowLanes, depth.data()),
                  least, 1e-6F)
          << set->name;
      for (std::size_t k = 0; k < depth.size(); ++k) EXPECT_NEAR(depth[k], expected[k], 1e-6F);
      for (const float sign : {-1.0F, 1.0F}) {
        // Planes at random are never so near that rounding decides, with this seed.
        EXPECT_EQ(set->box_in_volumes(lanes.data(), &middle.x, &half.x, sign),
                  sets[0]->box_in_volumes(lanes.data(), &middle.x, &half.x, sign))
            << set->name;
      }
    }
  }
}

}  // namespace
}  // namespace rebounce::test_shadow_volumes
