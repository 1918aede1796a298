// Patches end where walls and blocks stand: cuts along contacts.

#include "precompute/patches/contact_cuts.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <random>

#include "precompute/exchange/pairs/form_factors.h"
#include "precompute/patches/welded_positions.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_contact_cuts {
namespace {

using Corners = std::array<glm::dvec3, 3>;

Corners corners_of(const Scene& scene, const Uint3& t) {
  return {to_dvec3(scene.position[t[0]]), to_dvec3(scene.position[t[1]]),
          to_dvec3(scene.position[t[2]])};
}

glm::dvec3 area_vector(const Corners& p) {
  return 0.5 * glm::cross(p[1] - p[0], p[2] - p[0]);
}

double area_of(const Scene& scene) {
  double area = 0;
  for (const Uint3& t : scene.triangle) area += glm::length(area_vector(corners_of(scene, t)));
  return area;
}

/// An upright wall without thickness, from a to b.
void add_wall(Scene& scene, const glm::dvec3& a, const glm::dvec3& b, double height) {
  const glm::dvec3 up(0, height, 0);
  test::add_polygon(scene, std::vector<glm::dvec3>{a, b, b + up, a + up});
}

void add_floor(Scene& scene, double half_width, std::uint32_t material = 0) {
  const double w = half_width;
  test::add_polygon(scene, std::vector<glm::dvec3>{{-w, 0, -w}, {-w, 0, w}, {w, 0, w}, {w, 0, -w}},
                    material);
}

void make_all_double_sided(Scene& scene) {
  for (Material& material : scene.materials) material.double_sided = true;
}

/// Cuts and subdivides as make_patch_model does.
void cut_and_subdivide(Scene& scene, const SubdivisionSettings& settings) {
  cut_at_contacts(scene, settings);
  subdivide(scene, std::vector<std::uint8_t>(scene.triangle.size(), 1), settings);
}

/// By how much triangles of the floor (y = 0) reach across the wall from `a` to `b`, metres: the
/// largest of the smaller of their reaches on either side of it, where they overlap its length.
double largest_reach_across(const Scene& scene, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 along = glm::normalize(b - a), across(-along.z, 0, along.x);
  double largest = 0;
  for (const Uint3& t : scene.triangle) {
    const Corners p = corners_of(scene, t);
    if (p[0].y != 0 || p[1].y != 0 || p[2].y != 0) continue;
    std::array<double, 3> d, s;
    for (int k = 0; k < 3; ++k) {
      d[k] = glm::dot(p[k] - a, across);
      s[k] = glm::dot(p[k] - a, along);
    }
    double left = 0, right = 0, low = 1e30, high = -1e30;
    for (int k = 0; k < 3; ++k) {
      left = std::max(left, d[k]);
      right = std::max(right, -d[k]);
      const int next = (k + 1) % 3;
      if (d[k] * d[next] > 0) continue;
      const double at = d[k] == d[next] ? s[k] : glm::mix(s[k], s[next], d[k] / (d[k] - d[next]));
      low = std::min(low, at);
      high = std::max(high, at);
    }
    const double overlap = std::min(high, glm::distance(a, b)) - std::max(low, 0.0);
    if (overlap > 0.01) largest = std::max(largest, std::min(left, right));
  }
  return largest;
}

/// Every edge of a closed surface belongs to two triangles; each material has surfaces of its own.
void expect_closed(const Scene& scene) {
  const WeldedPositions welded = weld_positions(scene.position);
  std::map<std::array<std::uint32_t, 3>, int> uses;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] =
          std::minmax(welded.id[scene.triangle[t][k]], welded.id[scene.triangle[t][(k + 1) % 3]]);
      ++uses[{scene.triangle_material[t], low, high}];
    }
  }
  for (const auto& [edge, count] : uses) ASSERT_EQ(count, 2);
}

double smallest_height(const Scene& scene) {
  double smallest = 1e30;
  for (const Uint3& t : scene.triangle) {
    const Corners p = corners_of(scene, t);
    const double longest =
        std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
    smallest = std::min(smallest, 2 * glm::length(area_vector(p)) / longest);
  }
  return smallest;
}

TEST(ContactCuts, NoPatchLiesOnTwoSidesOfAWall) {
  const unsigned seed = 5;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> place(-3.5, 3.5), sink(-0.5, 0.5);
  int straddled_before = 0, walls = 0;
  for (int round = 0; round < 45; ++round) {
    Scene scene = test::empty_scene();
    add_floor(scene, 4);
    std::vector<std::array<glm::dvec3, 2>> feet;
    for (int w = 0; w < 1 + round % 3; ++w) {
      const glm::dvec3 a(place(engine), 0, place(engine)), b(place(engine), 0, place(engine));
      if (glm::distance(a, b) < 0.5) continue;
      // Every third wall goes on below the floor.
      const double depth = w % 3 == 2 ? std::abs(sink(engine)) : 0;
      add_wall(scene, a - glm::dvec3(0, depth, 0), b - glm::dvec3(0, depth, 0), 1.5 + depth);
      feet.push_back({a, b});
    }
    Scene uncut = scene;
    subdivide(uncut, std::vector<std::uint8_t>(uncut.triangle.size(), 1), {.patch_count = 800});
    cut_and_subdivide(scene, {.patch_count = 800});
    for (const auto& [a, b] : feet) {
      ++walls;
      straddled_before += largest_reach_across(uncut, a, b) > 0.02 ? 1 : 0;
      ASSERT_LT(largest_reach_across(scene, a, b), 0.002) << "round " << round;
    }
    ASSERT_NEAR(area_of(scene), area_of(uncut), 1e-5 * area_of(uncut));
    for (const Uint3& t : scene.triangle) {
      const Corners p = corners_of(scene, t);
      if (p[0].y == 0 && p[1].y == 0 && p[2].y == 0) {
        ASSERT_GT(area_vector(p).y, 0) << "not turned over";
      }
    }
    ASSERT_GT(smallest_height(scene), 1e-4) << "round " << round;
  }
  EXPECT_GT(walls, 70);
  EXPECT_GT(straddled_before, walls / 2) << "there was something to cut";
}

TEST(ContactCuts, NoMergedPatchLiesOnTwoSidesOfAWall) {
  const unsigned seed = 23;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> place(-1.4, 1.8);
  std::size_t merged = 0;
  for (int round = 0; round < 12; ++round) {
    Scene scene = test::empty_scene();
    test::add_ball(scene, 24, 12, false);
    for (Float3& p : scene.position) p = {0.2F * p[0], 0.2F * p[1] + 1.5F, 0.2F * p[2] - 1.7F};
    test::add_box(scene, {-2, 0, -2}, {2, 2, 2}, true);
    // From wall to wall, so that every floor patch is on one side.
    const glm::dvec3 a(-2, 0, place(engine)), b(2, 0, place(engine));
    add_wall(scene, a, b, 2);
    make_all_double_sided(scene);
    const PatchModel model = make_patch_model(scene, {.patch_count = 300});
    merged += model.element_count - model.patches.size();
    const glm::dvec3 across = glm::normalize(glm::dvec3(a.z - b.z, 0, b.x - a.x));
    std::vector<double> left(model.patches.size(), 0.0), right = left;
    const DisplayMesh& mesh = model.mesh;
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
      if (mesh.triangle_patch[t] == kNone) continue;
      for (const std::uint32_t v : mesh.triangle[t]) {
        const double d = glm::dot(to_dvec3(mesh.position[v]) - a, across);
        left[mesh.triangle_patch[t]] = std::max(left[mesh.triangle_patch[t]], d);
        right[mesh.triangle_patch[t]] = std::max(right[mesh.triangle_patch[t]], -d);
      }
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
      EXPECT_LT(std::min(left[i], right[i]), 0.002) << "round " << round;
    }
  }
  EXPECT_GT(merged, 50U);
}

TEST(ContactCuts, ClosedBoxesStayClosed) {
  const unsigned seed = 9;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> low(0.3, 2.0), size(0.3, 1.5);
  for (int round = 0; round < 30; ++round) {
    Scene scene = test::empty_scene();
    scene.materials.resize(4, scene.materials[0]);
    test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
    for (std::uint32_t k = 1; k < 4; ++k) {
      // Some stand on the floor, some hang in the air, and they pass through one another.
      const glm::dvec3 from(low(engine), k == 1 ? 0 : low(engine) - 1, low(engine));
      test::add_box(scene, from, from + glm::dvec3(size(engine), size(engine), size(engine)), false,
                    k);
    }
    const std::size_t triangles = scene.triangle.size();
    const double area = area_of(scene);
    cut_at_contacts(scene, {.patch_count = 1000});
    EXPECT_GT(scene.triangle.size(), triangles + 20);
    EXPECT_NEAR(area_of(scene), area, 1e-5 * area);
    expect_closed(scene);
  }
}

TEST(ContactCuts, KeepMaterialsAttributesAndSurfaces) {
  Scene scene = test::empty_scene();
  scene.materials.resize(3, scene.materials[0]);
  add_floor(scene, 2, 1);
  test::add_box(scene, {-0.5, 0, -0.7}, {0.9, 1, 0.6}, false, 2);
  // Attributes that are affine in the position must stay so.
  const auto texcoord = [](const Float3& p) {
    return Float2{0.5F * p[0] + 1, p[2] - 0.25F * p[0]};
  };
  const auto color = [](const Float3& p) { return Float3{0.1F * p[0] + 0.5F, 0.5F, 0.2F * p[2]}; };
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    scene.base_color_texcoord[v] = texcoord(scene.position[v]);
    scene.emissive_texcoord[v] = texcoord(scene.position[v]);
    scene.vertex_color[v] = color(scene.position[v]);
  }
  cut_at_contacts(scene, {.patch_count = 600});
  ASSERT_EQ(scene.triangle_material.size(), scene.triangle.size());
  double floor_area = 0;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const glm::dvec3 area = area_vector(corners_of(scene, scene.triangle[t]));
    if (scene.triangle_material[t] == 1) floor_area += area.y;
  }
  EXPECT_NEAR(floor_area, 16, 1e-4);
  ASSERT_EQ(scene.normal.size(), scene.position.size());
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    const Float3& p = scene.position[v];
    EXPECT_NEAR(glm::length(to_glm(scene.normal[v])), 1, 1e-5);
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(scene.base_color_texcoord[v][k], texcoord(p)[k], 1e-5);
      EXPECT_NEAR(scene.emissive_texcoord[v][k], texcoord(p)[k], 1e-5);
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(scene.vertex_color[v][k], color(p)[k], 1e-5);
  }
}

TEST(ContactCuts, HoldWhereverTheSceneLiesAndForRoundedCoordinates) {
  const unsigned seed = 17;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 20; ++round) {
    Scene scene = test::empty_scene();
    scene.materials.resize(3, scene.materials[0]);
    add_floor(scene, 2, 1);
    const glm::dvec3 low(-0.9 + 0.4 * uniform(engine), 0, -0.8 + 0.4 * uniform(engine));
    const glm::dvec3 high(0.7 + 0.4 * uniform(engine), 1, 0.8 + 0.4 * uniform(engine));
    test::add_box(scene, low, high, false, 2);
    const glm::dvec3 axis =
        glm::normalize(glm::dvec3(uniform(engine), uniform(engine), uniform(engine)));
    const glm::dmat4 place = glm::translate(glm::rotate(glm::dmat4(1), 3 * uniform(engine), axis),
                                            glm::dvec3(30, -20, 40));
    for (Float3& p : scene.position) p = to_float3(glm::dvec3(place * glm::dvec4(to_dvec3(p), 1)));
    const double area = area_of(scene);
    cut_at_contacts(scene, {.patch_count = 500});
    EXPECT_NEAR(area_of(scene), area, 1e-5 * area);
    const glm::dmat4 back = glm::inverse(place);
    double covered = 0;
    for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
      if (scene.triangle_material[t] != 1) continue;
      const Corners p = corners_of(scene, scene.triangle[t]);
      const glm::dvec3 middle(back * glm::dvec4((p[0] + p[1] + p[2]) / 3.0, 1));
      if (middle.x < low.x || middle.x > high.x || middle.z < low.z || middle.z > high.z) continue;
      covered += glm::length(area_vector(p));
    }
    EXPECT_NEAR(covered, (high.x - low.x) * (high.z - low.z), 1e-3);
  }
}

TEST(ContactCuts, FollowTheOutlineOfWhatLiesFlatOrHangsClose) {
  // A lamp of two triangles a centimetre below a ceiling: cut along its outline, not its diagonal.
  Scene scene = test::empty_scene();
  scene.materials.resize(2, scene.materials[0]);
  const double y = 2.99;
  test::add_polygon(scene, std::vector<glm::dvec3>{{-2, 3, -2}, {2, 3, -2}, {2, 3, 2}, {-2, 3, 2}});
  const std::size_t ceiling = scene.triangle.size();
  test::add_polygon(
      scene,
      std::vector<glm::dvec3>{{-0.9, y, -0.3}, {0.8, y, -0.3}, {0.8, y, 0.6}, {-0.9, y, 0.6}}, 1);
  cut_at_contacts(scene, {.patch_count = 200});
  EXPECT_GT(scene.triangle.size(), ceiling + 10);
  double above = 0;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    if (scene.triangle_material[t] != 0) continue;
    const Corners p = corners_of(scene, scene.triangle[t]);
    const glm::dvec3 middle = (p[0] + p[1] + p[2]) / 3.0;
    const bool inside = middle.x > -0.9 && middle.x < 0.8 && middle.z > -0.3 && middle.z < 0.6;
    if (inside) above += glm::length(area_vector(p));
  }
  EXPECT_NEAR(above, 1.7 * 0.9, 1e-4);
}

TEST(ContactCuts, FloorUnderABlockIsItsOwnAndUnlit) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  test::add_box(scene, {1.1, 0, 1.3}, {2.2, 1, 2.9}, false);
  const PatchModel model = make_patch_model(scene, {.patch_count = 600});
  double up = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    const Float3& c = model.patches.centroid[i];
    if (model.patches.normal[i][1] > 0.9F && c[1] < 0.5F) up += model.patches.area[i];
  }
  EXPECT_NEAR(up, 20 - 1.1 * 1.6, 1e-3);
}

TEST(ContactCuts, LeaveAloneWhatNeedsNoCut) {
  const auto count_after = [](Scene scene) {
    cut_at_contacts(scene, {.patch_count = 500});
    return scene.triangle.size();
  };
  Scene room = test::empty_scene();
  test::add_box(room, {0, 0, 0}, {4, 3, 5}, true);
  EXPECT_EQ(count_after(room), 12U) << "walls that meet in their edges";
  Scene copies = room;
  test::add_box(copies, {0, 0, 0}, {4, 3, 5}, true);
  EXPECT_EQ(count_after(copies), 24U) << "copies in one another";
  Scene hanging = room, hovering = room;
  test::add_box(hanging, {1, 0.3, 1}, {2, 1, 2}, false);
  EXPECT_EQ(count_after(hanging), 24U) << "a gap of 0.7 patches";
  test::add_box(hovering, {1, 0.1, 1}, {2, 1, 2}, false);
  EXPECT_GT(count_after(hovering), 24U) << "a gap of 0.2 patches";
  Scene below = room;
  add_wall(below, {1, -1, 1}, {3, -1, 2}, 1.0);
  EXPECT_EQ(count_after(below), 14U) << "what ends behind a one-sided floor";
  Scene legs = room;
  for (int k = 0; k < 8; ++k) {
    const glm::dvec3 at(0.4 + 0.4 * k, 0, 1.1);
    test::add_box(legs, at, at + glm::dvec3(0.05, 0.5, 0.05), false);
  }
  EXPECT_EQ(count_after(legs), 12U + 8 * 12) << "legs of a chair";
}

TEST(ContactCuts, EndFarFromTheOriginAndBelowRounding) {
  // A kilometre away, coordinates are rounded to some 0.1 mm, about what the patches measure.
  Scene scene = test::empty_scene();
  add_floor(scene, 0.01);
  test::add_box(scene, {-0.004, 0, -0.003}, {0.005, 0.006, 0.004}, false);
  for (Float3& p : scene.position) p[0] += 1000;
  cut_at_contacts(scene, {.patch_count = 5000});
  EXPECT_LT(scene.triangle.size(), 10000U);
}

TEST(ContactCuts, ManyContactsDoNotShredTheFloor) {
  Scene scene = test::empty_scene();
  add_floor(scene, 2);
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const glm::dvec3 at(-1.9 + 0.19 * i, 0, -1.9 + 0.19 * j);
      test::add_box(scene, at, at + glm::dvec3(0.15, 0.02, 0.15), false);
    }
  }
  const std::size_t before = scene.triangle.size();
  cut_at_contacts(scene, {.patch_count = 400});
  EXPECT_LT(scene.triangle.size(), before + 1000);
}

TEST(ContactCuts, AreTheSameEveryTime) {
  const auto make = [] {
    Scene scene = test::empty_scene();
    add_floor(scene, 3);
    add_wall(scene, {-2, 0, -1}, {1.7, 0, 2.1}, 2);
    test::add_box(scene, {-0.5, 0, -1.7}, {0.9, 1, 0.6}, false);
    cut_at_contacts(scene, {.patch_count = 700});
    return scene;
  };
  const Scene a = make(), b = make();
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.triangle, b.triangle);
}

/// Two rooms of 3 x 3 x 3 m with a wall of some thickness (or none) between them. Floor, ceiling
/// and two walls belong to both rooms.
Scene two_rooms(double thickness) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {6.2, 3, 3}, true);
  const double x = 2.937;
  if (thickness == 0) {
    test::add_polygon(scene, std::vector<glm::dvec3>{{x, 0, 0}, {x, 3, 0}, {x, 3, 3}, {x, 0, 3}});
    make_all_double_sided(scene);
  } else {
    test::add_box(scene, {x, 0, 0}, {x + thickness, 3, 3}, false);
  }
  return scene;
}

class TwoRooms : public ::testing::TestWithParam<double> {};

TEST_P(TwoRooms, ExchangeNoLight) {
  const PatchModel model = make_patch_model(two_rooms(GetParam()), {.patch_count = 500});
  const FormFactors f = compute_form_factors(model, test::make_tracer(model));
  const auto in_first = [&](std::size_t i) {
    // Of the wall's own patches those that face the first room.
    const double x = model.patches.centroid[i][0];
    return x < 2.936 || (x < 2.938 && model.patches.normal[i][0] < -0.9F);
  };
  std::size_t first = 0;
  double leak = 0;
  for (std::size_t i = 0; i < model.patches.size(); ++i) {
    first += in_first(i) ? 1 : 0;
    for (std::uint64_t k = f.exchange.row_begin[i]; k < f.exchange.row_begin[i + 1]; ++k) {
      if (in_first(i) != in_first(f.exchange.column[k])) leak += f.exchange.exchange_area[k];
    }
  }
  EXPECT_GT(first, 100U);
  EXPECT_LT(first, model.patches.size() - 100);
  EXPECT_EQ(leak, 0);
  // Between merged triangles that touch, what is exact for single ones is a quadrature.
  const bool merged = model.element_count > model.patches.size();
  EXPECT_LT(f.closure.row_sum_error_before, merged ? 2e-3 : 1e-3);
}

INSTANTIATE_TEST_SUITE_P(WallThickness, TwoRooms, ::testing::Values(0.0, 0.02, 0.15));

}  // namespace
}  // namespace rebounce::test_contact_cuts
