#include "precompute/outputs/reconstruction_weights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "precompute/patches/patch_model.h"
#include "precompute/patches/vertex_split.h"
#include "runtime/rays/triangle.h"
#include "tests/support/test_scenes.h"

namespace rebounce::test_reconstruction_weights {
namespace {

/// The patches of a scene with weights, nothing of them covered.
PatchModel make_weighted_model(Scene scene, std::size_t patch_count) {
  PatchModel model = make_patch_model(std::move(scene), {.patch_count = patch_count});
  const std::vector<float> absorbed(model.patches.size(), 0.0F);
  compute_reconstruction_weights(model.shown_patch, absorbed, test::make_tracer(model), model.mesh);
  return model;
}

/// A floor of size 2 around the origin in `squares` x `squares` squares, which share their corners.
void add_tiled_floor(Scene& scene, std::uint32_t squares) {
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  const float step = 2.0F / static_cast<float>(squares);
  for (std::uint32_t i = 0; i <= squares; ++i) {
    for (std::uint32_t j = 0; j <= squares; ++j) {
      scene.position.push_back(
          {static_cast<float>(i) * step - 1, 0, static_cast<float>(j) * step - 1});
      scene.normal.push_back({0, 1, 0});
      scene.base_color_texcoord.push_back({0, 0});
      scene.emissive_texcoord.push_back({0, 0});
      scene.vertex_color.push_back({1, 1, 1});
    }
  }
  for (std::uint32_t i = 0; i < squares; ++i) {
    for (std::uint32_t j = 0; j < squares; ++j) {
      const std::uint32_t v = first + i * (squares + 1) + j;
      scene.triangle.push_back({v, v + 1, v + squares + 2});
      scene.triangle.push_back({v, v + squares + 2, v + squares + 1});
      scene.triangle_material.insert(scene.triangle_material.end(), 2, 0);
    }
  }
}

/// What is shown at a vertex if each patch has the value `of_centroid`(its centroid).
template <typename Field>
double shown_value(const PatchModel& model, std::size_t v, const Field& of_centroid) {
  const DisplayMesh& mesh = model.mesh;
  double value = 0;
  for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
    value += mesh.weight[k] * of_centroid(model.patches.centroid[mesh.weight_patch[k]]);
  }
  return value;
}

TEST(ReconstructionWeights, ShowConstantLightWithFewPatches) {
  Scene scene = test::empty_scene();
  test::add_box(scene, {-3, -3, -2}, {4, 3, 5}, true);
  test::add_box(scene, {2, -3, 2}, {3, -1, 3}, false);
  test::add_ball(scene, 24, 12, false);
  const PatchModel model = make_weighted_model(std::move(scene), 700);
  const DisplayMesh& mesh = model.mesh;
  ASSERT_EQ(mesh.weight_begin.size(), mesh.position.size() + 1);
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (model.shown_patch[t] == kNone) continue;
    for (const std::uint32_t v : mesh.triangle[t]) {
      EXPECT_NEAR(shown_value(model, v, [](const Float3&) { return 1.0; }), 1, 1e-5);
      EXPECT_LE(mesh.weight_begin[v + 1] - mesh.weight_begin[v], 16U);
    }
  }
}

TEST(ReconstructionWeights, ShowALinearFieldOnAFloorOfClusters) {
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 40);
  const PatchModel model = make_weighted_model(std::move(scene), 200);
  ASSERT_LT(model.patches.size(), 250U);
  const double patch_size = std::sqrt(4.0 / static_cast<double>(model.patches.size()));
  const auto field = [](const Float3& p) { return 2.0 + p[0] + 0.5 * p[2]; };
  double inside = 0, at_edge = 0;
  for (std::size_t v = 0; v < model.mesh.position.size(); ++v) {
    const Float3& p = model.mesh.position[v];
    const double error = std::abs(shown_value(model, v, field) - field(p));
    const bool is_inside = std::max(std::abs(p[0]), std::abs(p[2])) < 1 - patch_size;
    (is_inside ? inside : at_edge) = std::max(is_inside ? inside : at_edge, error);
  }
  EXPECT_LT(inside, 0.03) << "of values between 0.5 and 3.5";
  EXPECT_LT(at_edge, patch_size) << "no weights >= 0 can reach beyond the outermost centroids";
}

TEST(ReconstructionWeights, KeepTheMeansOfPatches) {
  // The mean of what is shown on a patch is the patch's value, also where light has a peak.
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 40);
  const PatchModel model = make_weighted_model(std::move(scene), 200);
  const DisplayMesh& mesh = model.mesh;
  const auto field = [](const Float3& p) { return std::exp(-8 * (p[0] * p[0] + p[2] * p[2])); };
  std::vector<double> mean(model.patches.size(), 0.0), count(model.patches.size(), 0.0);
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {  // all of one size
    for (const std::uint32_t v : mesh.triangle[t]) {
      mean[mesh.triangle_patch[t]] += shown_value(model, v, field);
      count[mesh.triangle_patch[t]] += 1;
    }
  }
  for (std::size_t i = 0; i < mean.size(); ++i) {
    EXPECT_NEAR(mean[i] / count[i], field(model.patches.centroid[i]), 0.02);
  }
}

TEST(ReconstructionWeights, AreNegativeOnlyInPart) {
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 40);
  const PatchModel model = make_weighted_model(std::move(scene), 200);
  const DisplayMesh& mesh = model.mesh;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    double negative = 0;
    for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
      negative += std::min(0.0F, mesh.weight[k]);
    }
    EXPECT_GT(negative, -0.6);
  }
}

TEST(ReconstructionWeights, TakeNothingFromBehindAWall) {
  // The wall stands on vertices of the floor, which both sides share in the scene.
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 10);
  const std::vector<glm::dvec3> wall = {{-1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 1, 0}};
  test::add_polygon(scene, wall);
  const PatchModel model = make_weighted_model(std::move(scene), 500);
  const auto is_behind = [](const Float3& p) { return p[2] < 0 ? 1.0 : 0.0; };
  int at_wall = 0;
  for (const Uint3& corner : model.mesh.triangle) {
    const auto z = [&](int k) { return model.mesh.position[corner[k]][2]; };
    if (std::ranges::any_of(corner, [&](auto v) { return model.mesh.position[v][1] > 0; }))
      continue;
    const double behind = z(0) + z(1) + z(2) < 0 ? 1 : 0;
    for (const std::uint32_t v : corner) {
      EXPECT_NEAR(shown_value(model, v, is_behind), behind, 1e-6);
      at_wall += model.mesh.position[v][2] == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(at_wall, 40);
}

TEST(ReconstructionWeights, TakeNothingFromUnderARug) {
  // A rug just above part of the floor: the floor outside must not show the light under it.
  Scene scene = test::empty_scene();
  const std::vector<glm::dvec3> floor = {{-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}};
  const std::vector<glm::dvec3> rug = {
      {-0.77, 0.01, -0.63}, {-0.77, 0.01, 0.71}, {0.69, 0.01, 0.71}, {0.69, 0.01, -0.63}};
  test::add_polygon(scene, floor);
  test::add_polygon(scene, rug);
  const PatchModel model = make_weighted_model(std::move(scene), 800);
  const auto under_the_rug = [&](const Float3& p, float margin) {
    return p[1] == 0 && p[0] > -0.77F - margin && p[0] < 0.69F + margin && p[2] > -0.63F - margin &&
           p[2] < 0.71F + margin;
  };
  // The floor is cut along the rug's outline, where each side has vertices of its own.
  const DisplayMesh& mesh = model.mesh;
  int outside = 0, excluded = 0;
  for (const Uint3& triangle : mesh.triangle) {
    Float3 middle{0, 0, 0};
    for (const std::uint32_t v : triangle) {
      for (int k = 0; k < 3; ++k) middle[k] += mesh.position[v][k] / 3;
    }
    if (middle[1] != 0 || under_the_rug(middle, 0)) continue;
    ++outside;
    excluded += under_the_rug(middle, 0.2F) ? 1 : 0;
    for (const std::uint32_t v : triangle) {
      for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
        EXPECT_FALSE(under_the_rug(model.patches.centroid[mesh.weight_patch[k]], 0));
      }
    }
  }
  EXPECT_GT(outside, 100);
  EXPECT_GT(excluded, 5) << "some triangles beside the rug were put to the test";
}

TEST(ReconstructionWeights, RespectCreases) {
  // In a box all faces are at right angles: a vertex takes from patches of its own face only.
  Scene scene = test::empty_scene();
  test::add_box(scene, {0, 0, 0}, {4, 3, 5}, true);
  const PatchModel model = make_weighted_model(std::move(scene), 600);
  const DisplayMesh& mesh = model.mesh;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    for (std::uint32_t k = mesh.weight_begin[v]; k < mesh.weight_begin[v + 1]; ++k) {
      EXPECT_GT(
          glm::dot(to_dvec3(mesh.normal[v]), to_dvec3(model.patches.normal[mesh.weight_patch[k]])),
          0.99);
    }
  }
}

TEST(ReconstructionWeights, UndoWhatCoveringTakesAway) {
  Scene scene = test::empty_scene();
  const std::vector<glm::dvec3> floor = {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}};
  test::add_polygon(scene, floor);
  PatchModel model = make_patch_model(scene, {.patch_count = 200});
  // Light of 1 everywhere; some patches are covered in part and their mean is less by that much.
  std::vector<float> absorbed(model.patches.size()), value(model.patches.size());
  for (std::size_t i = 0; i < absorbed.size(); ++i) {
    absorbed[i] = i % 3 == 0 ? 0.6F : 0.0F;
    value[i] = 1 - absorbed[i];
  }
  compute_reconstruction_weights(model.shown_patch, absorbed, test::make_tracer(model), model.mesh);
  for (std::size_t v = 0; v + 1 < model.mesh.weight_begin.size(); ++v) {
    double shown = 0;
    for (std::uint32_t k = model.mesh.weight_begin[v]; k < model.mesh.weight_begin[v + 1]; ++k) {
      shown += model.mesh.weight[k] * value[model.mesh.weight_patch[k]];
    }
    EXPECT_NEAR(shown, 1, 1e-5);
  }
}

TEST(ReconstructionWeights, ArriveAsTheyAreWhereNearlyAllLightIsAbsorbed) {
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 8);
  PatchModel model = make_patch_model(std::move(scene), {.patch_count = 64});
  for (const float part : {0.5F, 0.99F, 0.9997F}) {
    SCOPED_TRACE(part);
    const std::vector<float> absorbed(model.patches.size(), part);
    compute_reconstruction_weights(model.shown_patch, absorbed, test::make_tracer(model),
                                   model.mesh);
    const double wanted = part < 0.9F ? 1 / (1 - part) : 1;
    for (std::size_t v = 0; v < model.mesh.position.size(); ++v) {
      EXPECT_NEAR(shown_value(model, v, [](const Float3&) { return 1.0; }), wanted, 1e-3);
    }
  }
}

TEST(ReconstructionWeights, WhatHasNoPatchShowsTheLightBesideIt) {
  // What is taken for hidden shows light where it meets others in the open, unless it is walled in.
  const std::vector<glm::dvec3> corner = {{0, 0, 0}, {0, 0, 0.2}, {0.2, 0, 0.2}};
  for (const bool walled : {false, true}) {
    Scene scene = test::empty_scene();
    add_tiled_floor(scene, 10);
    for (int k = 0; walled && k < 3; ++k) {
      const glm::dvec3 a = corner[k], b = corner[(k + 1) % 3], up(0, 0.1, 0);
      const std::vector<glm::dvec3> wall = {b, a, a + up, b + up};
      test::add_polygon(scene, wall);
    }
    PatchModel model = make_patch_model(std::move(scene), {.patch_count = 100});
    const auto is_hidden = [](const glm::dvec3& p) {
      return p.y < 1e-6 && p.x > -1e-6 && p.z < 0.2 + 1e-6 && p.x < p.z + 1e-6;
    };
    for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
      if (std::ranges::all_of(corners_of(model.mesh, t), is_hidden)) model.shown_patch[t] = kNone;
    }
    const RayTracer tracer = test::make_tracer(model);
    split_vertices(model.shown_patch, tracer, 0, model.mesh);
    const std::vector<float> absorbed(model.patches.size(), 0.0F);
    compute_reconstruction_weights(model.shown_patch, absorbed, tracer, model.mesh);
    int at_corners = 0;
    for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
      if (model.shown_patch[t] != kNone) continue;
      for (const std::uint32_t v : model.mesh.triangle[t]) {
        const glm::dvec3 p = to_dvec3(model.mesh.position[v]);
        if (std::ranges::none_of(corner, [&](const auto& q) { return distance(p, q) < 1e-5; }))
          continue;
        EXPECT_NEAR(shown_value(model, v, [](const Float3&) { return 1.0; }), walled ? 0 : 1, 1e-5);
        ++at_corners;
      }
    }
    EXPECT_GE(at_corners, 3);
  }
}

TEST(ReconstructionWeights, LightEndsWhereACoverDoes) {
  // A plate of 0.8 m 2 mm above a floor of 2 m: below it dim, beside it white. What is below shows
  // what arrives there, however much of its view the plate's back takes.
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 1);
  test::add_box(scene, {-0.4, 0.002, -0.4}, {0.4, 0.012, 0.4}, false);
  PatchModel model = make_patch_model(std::move(scene), {.patch_count = 300});
  const auto is_below = [](const Float3& p) {
    return p[1] < 0.01F && std::max(std::abs(p[0]), std::abs(p[2])) < 0.4F;
  };
  const auto field = [&](const Float3& p) { return is_below(p) ? 0.2 : 1.0; };
  std::vector<float> absorbed;
  for (const Float3& p : model.patches.centroid) absorbed.push_back(is_below(p) ? 0.75F : 0);
  compute_reconstruction_weights(model.shown_patch, absorbed, test::make_tracer(model), model.mesh);
  std::size_t below = 0, beside = 0, between = 0, even = 0;
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    const TriangleCorners p = corners_of(model.mesh, t);
    if (std::max({p[0].y, p[1].y, p[2].y}) > 1e-3 || model.shown_patch[t] == kNone) continue;
    const auto corners_below =
        std::ranges::count_if(p, [&](const glm::dvec3& c) { return is_below(to_float3(c)); });
    ++(corners_below == 3 ? below : corners_below == 0 ? beside : between);
    for (const std::uint32_t v : model.mesh.triangle[t]) {
      const double shown = shown_value(model, v, field);
      // What stands out from below is seen. It shows what its patch has in the open (of 0.2 with
      // 0.75 absorbed 0.8), more or less as the means of patches are kept, and what is next to it
      // shares its vertices.
      if (corners_below == 3) {
        EXPECT_NEAR(shown, 0.2, 1e-5);
      } else {
        EXPECT_GT(shown, 0.65);
        EXPECT_LT(shown, 1.06);
        even += corners_below == 0 && std::abs(shown - 1) < 0.05 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(below, 20U);
  EXPECT_GT(beside, 100U);
  EXPECT_GT(between, 10U);
  EXPECT_GT(even, 3 * (3 * beside) / 4) << "corners of triangles";
}

TEST(ReconstructionWeights, ASlotShowsWhatArrivesInIt) {
  // Deep in a slot of 2 cm below a plate of 1.2 m all patches are covered: that nine tenths of
  // their view give nothing says that it is dark there, not that they are half under something.
  Scene scene = test::empty_scene();
  add_tiled_floor(scene, 1);
  test::add_box(scene, {-0.6, 0.02, -0.6}, {0.6, 0.03, 0.6}, false);
  PatchModel model = make_patch_model(std::move(scene), {.patch_count = 300});
  const auto reaches = [](const Float3& p, float edge) {
    return p[1] < 0.01F && std::max(std::abs(p[0]), std::abs(p[2])) < edge;
  };
  std::vector<float> absorbed;
  for (const Float3& p : model.patches.centroid) absorbed.push_back(reaches(p, 0.6F) ? 0.9F : 0);
  compute_reconstruction_weights(model.shown_patch, absorbed, test::make_tracer(model), model.mesh);
  int deep = 0;
  for (std::uint32_t t = 0; t < model.mesh.triangle.size(); ++t) {
    if (model.shown_patch[t] == kNone) continue;
    for (const std::uint32_t v : model.mesh.triangle[t]) {
      if (!reaches(model.mesh.position[v], 0.3F)) continue;
      EXPECT_NEAR(shown_value(model, v, [](const Float3&) { return 0.2; }), 0.2, 1e-5);
      ++deep;
    }
  }
  EXPECT_GT(deep, 30);
}

}  // namespace
}  // namespace rebounce::test_reconstruction_weights
