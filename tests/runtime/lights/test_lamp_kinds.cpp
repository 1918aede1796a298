// The table of lamp kinds, and what every kind must hold to.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>

#include "runtime/lights/lamp_geometry.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/lights/light_sampling.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"
#include "tests/support/expect_error.h"

namespace rebounce::test_lamp_kinds {
namespace {

TEST(LampGeometry, ATangentAlongTheAxisStillGivesSides) {
  for (const glm::vec3& axis : {glm::vec3(1, 0, 0), glm::vec3(0, -1, 0), glm::vec3(0, 0, 1)}) {
    const auto [side, other_side] = sides_around(axis, 3.0F * axis);
    EXPECT_NEAR(glm::length(side), 1, 1e-6);
    EXPECT_NEAR(glm::length(other_side), 1, 1e-6);
    EXPECT_NEAR(glm::dot(side, axis), 0, 1e-6);
    EXPECT_NEAR(glm::dot(side, other_side), 0, 1e-6);
  }
}

/// A lamp of the kind whose fields are as they should be.
Light good_lamp(const LampKind& kind) {
  Light light;
  light.type = kind.type;
  light.position = {0.2F, 1.5F, -0.1F};
  for (const LampField* field : kind.fields) {
    if (field->rule != FieldRule::kLength) continue;
    for (float& value : field->values(light)) value = 0.3F;
  }
  return light;
}

TEST(LampKinds, AreInTheOrderOfTheirTypeAndOfDifferentNames) {
  std::set<std::string_view> names;
  for (std::size_t k = 0; k < lamp_kinds().size(); ++k) {
    const LampKind& kind = *lamp_kinds()[k];
    EXPECT_EQ(static_cast<std::size_t>(kind.type), k);
    EXPECT_EQ(&lamp_kind(kind.type), &kind);
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
  }
  EXPECT_EQ(lamp_kind(LightType::kDisc).name, "disc");
}

TEST(LampKinds, HaveEitherOnePlaceOrASurface) {
  for (const LampKind* kind : lamp_kinds()) {
    EXPECT_NE(kind->evaluate == nullptr, kind->surface == nullptr) << kind->name;
    EXPECT_EQ(kind->evaluate == nullptr, kind->evaluate_block == nullptr) << kind->name;
    EXPECT_EQ(kind->surface != nullptr, kind->shadow_map == ShadowMapKind::kPlaces) << kind->name;
    const std::string glsl = kind->glsl;
    const std::string name(kind->name);
    EXPECT_NE(glsl.find("float " + name + "_irradiance("), std::string::npos) << name;
    EXPECT_EQ(glsl.find("vec3 " + name + "_normal(") != std::string::npos, kind->surface != nullptr)
        << name;
  }
}

TEST(LampKinds, RefuseNumbersThatAreNotOnes) {
  for (const LampKind* kind : lamp_kinds()) {
    const Light good = good_lamp(*kind);
    EXPECT_NO_THROW(check_light(good)) << kind->name;
    for (const LampField* field : kind->fields) {
      Light bad = good;
      const std::span<float> values = field->values(bad);
      if (values.empty()) continue;
      values.back() = std::numeric_limits<float>::quiet_NaN();
      test::expect_error([&] { check_light(bad); }, std::string(field->name));
    }
  }
}

TEST(LampKinds, LightBlocksOfPointsAsTheyDoEachPoint) {
  constexpr unsigned kSeed = 5;
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<float> place(-1, 2);
  const auto profile = std::make_shared<IntensityProfile>();
  profile->vertical = {0, 2};
  profile->horizontal = {0};
  profile->candela = {100, 20};
  int lit = 0, dark = 0;
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->surface != nullptr) continue;
    for (const bool special : {false, true}) {
      Light light = good_lamp(*kind);
      light.inner_cone_angle = 0.4F;
      light.outer_cone_angle = 0.9F;
      if (special) {
        light.range = 2;
        light.profile = profile;
      }
      const PreparedLight lamp(light);
      PatchPointBlock points{};
      for (auto& coordinates : points.position) {
        for (float& x : coordinates) x = place(engine);
      }
      for (int axis = 0; axis < 3; ++axis) points.position[axis][17] = lamp.position[axis];
      UnitLightBlock block;
      for (std::size_t k = 0; k < PatchPointBlock::kSize; ++k) {
        if (k % UnitLightBlock::kPart == 0) lamp.evaluate(points, k / UnitLightBlock::kPart, block);
        const UnitLight one = lamp.evaluate(points.at(k)), of_block = block.at(k);
        EXPECT_EQ(of_block.direction, one.direction) << kind->name << " " << k;
        EXPECT_EQ(of_block.distance, one.distance) << kind->name << " " << k;
        EXPECT_EQ(of_block.illuminance, one.illuminance) << kind->name << " " << k;
        (one.illuminance > 0 ? lit : dark) += 1;
      }
    }
  }
  EXPECT_GT(lit, 100);
  EXPECT_GT(dark, 50);
}

TEST(LampKinds, SurfacesLightBlocksOfPointsAsTheyDoEachPoint) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<float> place(-1, 2), one(0, 1);
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->surface == nullptr) continue;
    SCOPED_TRACE(kind->name);
    int whole = 0, cut = 0, dark = 0;
    for (int round = 0; round < 20; ++round) {
      const PreparedLight lamp(good_lamp(*kind));
      PatchPointBlock points{};
      for (std::size_t k = 0; k < PatchPointBlock::kSize; ++k) {
        const glm::vec3 normal = glm::normalize(glm::vec3(place(engine), place(engine), 0.1F));
        for (int axis = 0; axis < 3; ++axis) {
          points.position[axis][k] = place(engine);
          points.normal[axis][k] = normal[axis];
        }
      }
      for (std::size_t part = 0; part < PatchPointBlock::kSize / UnitLightBlock::kPart; ++part) {
        PartValues irradiance, u, v;
        for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
          u[e] = one(engine);
          v[e] = one(engine);
        }
        lamp.unoccluded_irradiance(points, part, irradiance);
        PlacesOfPart places;
        kind->surface->places_of_part(lamp, points, part, u, v, places);
        for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
          const std::size_t k = part * UnitLightBlock::kPart + e;
          const glm::vec3 at = points.at(k), normal = points.normal_at(k);
          const float expected = lamp.unoccluded_irradiance(at, normal);
          EXPECT_NEAR(irradiance[e], expected, 2e-5F * expected + 1e-7F);
          const bool above = glm::dot(lamp.highest_point(-normal) - at, normal) > 0;
          ++(expected == 0 ? dark : above ? whole : cut);
          const glm::vec2 square(u[e], v[e]);
          UnitLight light;
          lamp.evaluate_places(at, {&square, 1}, {&light, 1});
          if (light.illuminance == 0) continue;
          const glm::vec3 path(places.path[0][e], places.path[1][e], places.path[2][e]);
          EXPECT_LT(glm::distance(path, light.direction * light.distance), 1e-5F);
          EXPECT_EQ(places.weight[e] > 0, glm::dot(path, normal) > 0);
        }
      }
    }
    EXPECT_GT(whole, 100);
    EXPECT_GT(cut, 20);
    EXPECT_GT(dark, 100);
  }
}

TEST(LampKinds, PlacesWeighWhatTheyAddToTheLight) {
  constexpr unsigned kSeed = 12;
  SCOPED_TRACE(kSeed);
  std::mt19937 engine(kSeed);
  std::uniform_real_distribution<float> one(0, 1);
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->surface == nullptr) continue;
    const PreparedLight lamp(good_lamp(*kind));
    // The same point in all lanes, so that all weights have one unit.
    PatchPointBlock points{};
    const glm::vec3 normal = glm::normalize(glm::vec3(0.3F, 1, 0.2F));
    for (int axis = 0; axis < 3; ++axis) points.normal[axis].fill(normal[axis]);
    PartValues u, v;
    for (std::size_t e = 0; e < u.size(); ++e) {
      u[e] = one(engine);
      v[e] = one(engine);
    }
    PlacesOfPart places;
    kind->surface->places_of_part(lamp, points, 0, u, v, places);
    float unit = 0;
    for (std::size_t e = 0; e < u.size(); ++e) {
      const glm::vec2 square(u[e], v[e]);
      UnitLight light;
      lamp.evaluate_places(points.at(e), {&square, 1}, {&light, 1});
      const float added = light.illuminance * glm::dot(light.direction, normal);
      if (e == 0) unit = places.weight[0] / added;
      EXPECT_NEAR(places.weight[e], unit * added, 1e-5F * unit * added) << kind->name;
    }
    EXPECT_GT(unit, 0) << kind->name;
  }
}

/// The irradiance at the origin: the mean over many places of the lamp.
double mean_of_places(const PreparedLight& lamp, const glm::vec3& normal) {
  constexpr int kSide = 200;
  double sum = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const int row = k / kSide, column = k % kSide;
    const glm::vec2 place((static_cast<float>(column) + 0.5F) / kSide,
                          (static_cast<float>(row) + 0.5F) / kSide);
    UnitLight light;
    lamp.evaluate_places({0, 0, 0}, {&place, 1}, {&light, 1});
    sum += light.illuminance * std::max(0.0F, glm::dot(light.direction, normal));
  }
  return sum / (kSide * kSide);
}

TEST(LampKinds, SurfacesShineAsTheirPlacesDoWhereverTheHorizonCuts) {
  int count = 0;
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->surface == nullptr) continue;
    SCOPED_TRACE(kind->name);
    ++count;
    Light light = good_lamp(*kind);
    for (const glm::vec3& normal : {glm::vec3(0, 1, 0), glm::vec3(0.8F, 0.6F, 0)}) {
      const PreparedLight lamp(light);
      const double mean = mean_of_places(lamp, normal);
      EXPECT_GT(mean, 1e-3);
      EXPECT_NEAR(lamp.unoccluded_irradiance({0, 0, 0}, normal) / mean, 1, 1e-3);
    }
    for (const LampField* field : kind->fields) {
      if (field->rule != FieldRule::kLength) continue;
      for (float& value : field->values(light)) value = 0.9F;
    }
    int cut = 0;
    for (std::uint32_t k = 0; k < 40; ++k) {
      const glm::dvec2 s = r2_point(k, {0.4, 0.9}), t = r2_point(k, {0.7, 0.1});
      const glm::vec3 normal = glm::normalize(glm::vec3(2 * s.x - 1, 0.3 + s.y, 2 * t.x - 1));
      light.position = {static_cast<float>(2 * t.y - 1), 1, 0.4F};
      light.direction = to_float3(glm::normalize(glm::vec3(s.y - 0.5, -1, t.x - 0.5)));
      const PreparedLight lamp(light);
      cut += glm::dot(lamp.highest_point(normal), normal) > 0 &&
             glm::dot(lamp.highest_point(-normal), normal) < 0;
      const double mean = mean_of_places(lamp, normal);
      EXPECT_NEAR(lamp.unoccluded_irradiance({0, 0, 0}, normal), mean, 0.004 * mean + 1e-4) << k;
    }
    EXPECT_GE(cut, 8);
    EXPECT_LE(cut, 36);
  }
  EXPECT_GE(count, 3);
}

TEST(LampKinds, MeshesAndPlacesLieOnTheSurface) {
  for (const LampKind* kind : lamp_kinds()) {
    if (kind->surface == nullptr) continue;
    const PreparedLight lamp(good_lamp(*kind));
    const LampMesh mesh = kind->surface->mesh(lamp);
    ASSERT_EQ(mesh.normal.size(), mesh.position.size());
    double area = 0, turned_away = 0;
    for (const Uint3& t : mesh.triangle) {
      const glm::vec3 a = to_glm(mesh.position[t[0]]);
      const glm::vec3 twice =
          glm::cross(to_glm(mesh.position[t[1]]) - a, to_glm(mesh.position[t[2]]) - a);
      area += 0.5 * glm::length(twice);
      if (glm::dot(twice, to_glm(mesh.normal[t[0]])) < 0) turned_away += 0.5 * glm::length(twice);
    }
    EXPECT_NEAR(area / lamp.area, 1, 0.01) << kind->name;
    EXPECT_EQ(turned_away, 0) << kind->name;
    float reach = 0;
    for (const Float3& v : mesh.position) {
      reach = std::max(reach, glm::distance(to_glm(v), lamp.position));
    }
    constexpr std::uint32_t kPlaces = 16;
    glm::vec3 sum(0);
    for (std::uint32_t k = 0; k < kPlaces; ++k) {
      const glm::vec3 place = kind->surface->place(lamp, k, kPlaces);
      EXPECT_LE(glm::length(place), 1.001F * reach) << kind->name;
      sum += place;
    }
    EXPECT_LE(glm::length(sum) / kPlaces, 0.04F * reach) << kind->name;
  }
}

}  // namespace
}  // namespace rebounce::test_lamp_kinds
