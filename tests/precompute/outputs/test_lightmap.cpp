#include "precompute/outputs/lightmap.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>

#include "precompute/import/import_gltf.h"
#include "rebounce/outputs.h"
#include "runtime/frame/engine_parts.h"
#include "runtime/outputs/texel_light.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/patch_points.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/brute_force.h"
#include "tests/support/built_scene.h"
#include "tests/support/expect_error.h"
#include "tests/support/unwrapped_room.h"
#include "tests/support/with_threads.h"
#include "transfer/operator/receiver_products.h"

namespace rebounce::test_lightmap {
namespace {

constexpr std::uint32_t kSize = 256;

std::shared_ptr<const TransferData> build(const test::GltfBuilder& scene) {
  const test::TemporaryFolder folder;
  BuildSettings settings = test::quick_settings(900);
  settings.lightmap.size = kSize;
  BuildReport report;
  return std::make_shared<const TransferData>(
      build_transfer_data(scene.write_glb(folder), settings, report));
}

const std::shared_ptr<const TransferData>& room() {
  static const auto data = build(test::unwrapped_scene(test::unwrapped_room()));
  return data;
}

PatchModel model_of(const test::GltfBuilder& scene) {
  const test::TemporaryFolder folder;
  return make_patch_model(import_gltf(scene.write_glb(folder)), {.patch_count = 100});
}

/// The texels that `patch_value` gives.
std::vector<Float3> texels_of(const TransferData& data, std::span<const Float3> patch_value) {
  std::vector<Float3> vertex(data.mesh.position.size()), texel(data.lightmap.triangle.size());
  reconstruct_at_vertices(data.mesh, patch_value, vertex);
  light_at_texels(data.lightmap, data.mesh, vertex, texel);
  return texel;
}

/// True where a texel's middle lies within its triangle.
bool is_in_chart(const Lightmap& map, std::size_t k) {
  constexpr float kRim = 1e-3F;
  const auto [v, w] = map.weight[k];
  return map.triangle[k] != kNone && v > kRim && w > kRim && v + w < 1 - kRim;
}

PatchPoint place_of(const TransferData& data, std::size_t k) {
  const auto [a, b, c] = data.mesh.triangle[data.lightmap.triangle[k]];
  const auto at = [&](std::uint32_t v) { return to_dvec3(data.mesh.position[v]); };
  const double v = data.lightmap.weight[k][0], w = data.lightmap.weight[k][1];
  return {to_float3((1 - v - w) * at(a) + v * at(b) + w * at(c)),
          to_float3(glm::normalize(glm::cross(at(b) - at(a), at(c) - at(a))))};
}

/// F B at a point, by brute force.
glm::dvec3 gather(const Engine& engine, const PatchPoint& point) {
  const Float3 origin = engine.parts().tracer->offset_point(point.position, point.normal);
  return test::irradiance_at(engine, origin, point.normal, 1024);
}

Engine lit(const std::shared_ptr<const TransferData>& data) {
  Engine engine(data);
  Light lamp;
  lamp.position = {1.2F, 2.2F, 1.9F};
  lamp.intensity = 100;
  engine.relight({&lamp, 1}, {});
  return engine;
}

/// Relative L2 error of texels against brute-force gathers at every `step`-th of their middles, and
/// how many were compared.
std::pair<double, int> error_of(const Engine& engine, std::span<const Float3> texel,
                                std::size_t step) {
  double difference = 0, total = 0;
  int compared = 0;
  for (std::size_t k = 0; k < texel.size(); k += step) {
    if (!is_in_chart(engine.data().lightmap, k)) continue;
    const double truth = gather(engine, place_of(engine.data(), k)).y;
    if (truth == 0) continue;  // under the block
    ++compared;
    difference += (texel[k][1] - truth) * (texel[k][1] - truth);
    total += truth * truth;
  }
  return {std::sqrt(difference / total), compared};
}

/// Of few patches, whose texels have rows.
TransferData build_rows() {
  const test::TemporaryFolder folder;
  BuildSettings settings = test::quick_settings(150);
  settings.lightmap.size = 64;
  settings.receiver_rows.at_texels = true;
  BuildReport report;
  return build_transfer_data(test::unwrapped_scene(test::unwrapped_room()).write_glb(folder),
                             settings, report);
}

const std::shared_ptr<const TransferData>& room_with_rows() {
  static const auto data = std::make_shared<const TransferData>(build_rows());
  return data;
}

TEST(TexelRows, AreNearerToRaysThanInterpolation) {
  ASSERT_GT(room_with_rows()->texel_rows.group_count(), 1U);
  Engine engine = lit(room_with_rows());
  std::vector<Float3> texel(room_with_rows()->lightmap.triangle.size());
  lightmap_irradiance(engine, texel);
  const auto [with_rows, compared] = error_of(engine, texel, 3);
  const auto interpolated = texels_of(*room_with_rows(), engine.indirect_irradiance());
  const double without = error_of(engine, interpolated, 3).first;
  std::printf("%d texels: relative L2 error %.4f with rows, %.4f without\n", compared, with_rows,
              without);
  EXPECT_GT(compared, 300);
  EXPECT_LT(with_rows, 0.03);
  EXPECT_LT(with_rows, 0.5 * without);
}

TEST(TexelRows, LeaveEvenLightEven) {
  const TransferData& data = *room_with_rows();
  const std::vector<Float3> even(data.patches.size(), Float3{1, 1, 1});
  std::vector<Float3> added(data.lightmap.triangle.size(), Float3{0, 0, 0});
  ReceiverProducts(data.texel_rows, data.patches.area).add(even, added);
  const std::vector<Float3> without = texels_of(data, even);
  int count = 0;
  for (std::size_t k = 0; k < added.size(); ++k) {
    if (added[k][0] == 0) continue;
    ++count;
    EXPECT_NEAR(without[k][0] + added[k][0], 1, 1e-3) << k;
  }
  EXPECT_GT(count, 500);
}

// Under the block everything is dark, and filters would spread that.
TEST(TexelRows, AreNotInsideOfBodies) {
  const TransferData& data = *room_with_rows();
  const Engine engine = lit(room_with_rows());
  int count = 0;
  for (std::size_t k = 0; k < data.texel_rows.receiver.size(); k += 5) {
    const std::uint32_t texel = data.texel_rows.receiver[k];
    if (texel == kNone || !is_in_chart(data.lightmap, texel)) continue;
    ++count;
    EXPECT_GT(gather(engine, place_of(data, texel)).y, 0) << texel;
  }
  EXPECT_GT(count, 100);
}

TEST(TexelRows, AreTheSameOnAnyNumberOfThreadsAndAllocateNothing) {
  const TransferData again = test::with_threads(1, build_rows);
  EXPECT_EQ(again.texel_rows.value, room_with_rows()->texel_rows.value);
  EXPECT_EQ(again.texel_rows.receiver, room_with_rows()->texel_rows.receiver);
  Engine engine = lit(room_with_rows());
  std::vector<Float3> texel(room_with_rows()->lightmap.triangle.size());
  EXPECT_EQ(test::count_allocations([&] { lightmap_irradiance(engine, texel); }), 0);
}

TEST(TexelRows, NeedALightmap) {
  const test::TemporaryFolder folder;
  const auto path = test::unwrapped_scene(test::unwrapped_room()).write_glb(folder);
  BuildSettings settings = test::quick_settings(30);
  settings.receiver_rows.at_texels = true;
  BuildReport report;
  test::expect_error([&] { build_transfer_data(path, settings, report); }, "need a lightmap");
}

TEST(Lightmap, TexelsAreThatOfABruteForceGatherAtTheirMiddles) {
  const Engine engine = lit(room());
  const Lightmap& map = room()->lightmap;
  const std::vector<Float3> texel = texels_of(*room(), engine.indirect_irradiance());
  double difference = 0, total = 0;
  std::vector<double> relative;
  int compared = 0;
  for (std::size_t k = 0; k < texel.size(); k += 17) {
    if (!is_in_chart(map, k)) continue;
    const double truth = gather(engine, place_of(*room(), k)).y, found = texel[k][1];
    if (truth == 0) continue;  // under the block
    ++compared;
    difference += (found - truth) * (found - truth);
    total += truth * truth;
    relative.push_back(std::abs(found - truth) / truth);
  }
  ASSERT_GT(compared, 1000);
  const double error = std::sqrt(difference / total);
  std::ranges::sort(relative);
  const double median = relative[relative.size() / 2], p95 = relative[relative.size() * 95 / 100];
  std::printf("%d texels: relative L2 error %.4f, median %.4f, 95 %% %.4f\n", compared, error,
              median, p95);
  // The patches' own reconstruction (lab/023): 3 to 5 %; the gather's noise is 1 %.
  EXPECT_LE(error, 0.03);
  EXPECT_LE(median, 0.02);
  EXPECT_LE(p95, 0.1);
}

TEST(Lightmap, ConstantLightGivesConstantTexels) {
  const std::vector<Float3> one(room()->patches.size(), Float3{1, 2, 3});
  const std::vector<Float3> texel = texels_of(*room(), one);
  const Lightmap& map = room()->lightmap;
  int in_charts = 0;
  for (std::size_t k = 0; k < texel.size(); ++k) {
    if (map.triangle[k] == kNone || texel[k][0] == 0) continue;
    ++in_charts;
    EXPECT_NEAR(texel[k][0], 1, 1e-2);  // weights make up for what is partly covered
    EXPECT_NEAR(texel[k][1], 2 * texel[k][0], 1e-4);
    EXPECT_NEAR(texel[k][2], 3 * texel[k][0], 1e-4);
  }
  EXPECT_GT(in_charts, 20000);
}

/// Bilinear, as a graphics card filters; `at` in [0, 1].
glm::dvec3 sample(const Lightmap& map, std::span<const Float3> texel, const glm::dvec2& at) {
  const glm::dvec2 place = at * glm::dvec2(map.width, map.height) - 0.5;
  const glm::dvec2 low = glm::floor(place), part = place - low;
  const auto value = [&](int dx, int dy) {
    const std::size_t k =
        static_cast<std::size_t>(low.y + dy) * map.width + static_cast<std::size_t>(low.x + dx);
    EXPECT_NE(map.triangle[k], kNone) << "a filter reaches beyond the padding";
    return to_dvec3(texel[k]);
  };
  return glm::mix(glm::mix(value(0, 0), value(1, 0), part.x),
                  glm::mix(value(0, 1), value(1, 1), part.x), part.y);
}

TEST(Lightmap, ChartsThatMeetAgreeAlongTheirSeam) {
  const Engine engine = lit(room());
  const Lightmap& map = room()->lightmap;
  const DisplayMesh& mesh = room()->mesh;
  const std::vector<Float3> texel = texels_of(*room(), engine.indirect_irradiance());
  // The floor's vertices on the line x = 2, those of the left half and those of the right.
  std::array<std::vector<std::pair<float, Float2>>, 2> side;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (map.has_texels[t] == 0) continue;
    float mean = 0;
    for (const std::uint32_t v : mesh.triangle[t]) mean += mesh.position[v][0] / 3;
    for (const std::uint32_t v : mesh.triangle[t]) {
      const Float3& p = mesh.position[v];
      if (p[1] == 0 && p[0] == 2 && mesh.normal[v][1] > 0.5F) {
        side[mean < 2 ? 0 : 1].emplace_back(p[2], map.texcoord[v]);
      }
    }
  }
  for (auto& s : side) std::ranges::sort(s, {}, [](const auto& e) { return e.first; });
  const auto texcoord_at = [](const auto& s, float z) {
    const auto& [z0, at0] = s.front();
    const auto& [z1, at1] = s.back();  // a chart is a rectangle: linear along its side
    return glm::mix(glm::dvec2(to_glm(at0)), glm::dvec2(to_glm(at1)), (z - z0) / (z1 - z0));
  };
  double difference = 0, total = 0, largest = 0;
  for (int k = 0; k <= 200; ++k) {
    const float z = 3 * static_cast<float>(k) / 200;
    const double left = sample(map, texel, texcoord_at(side[0], z)).y;
    const double right = sample(map, texel, texcoord_at(side[1], z)).y;
    difference += (left - right) * (left - right);
    total += left * left;
    largest = std::max(largest, std::abs(left - right) / left);
  }
  const double error = std::sqrt(difference / total);
  std::printf("difference across the seam: %.4f, largest %.4f\n", error, largest);
  // Half a texel (1.6 cm) on either side, in light that changes by some 50 % a metre.
  EXPECT_LE(error, 0.01);
  EXPECT_LE(largest, 0.03);
}

TEST(Lightmap, EveryPlaceOfAMeshHasItsOwnPage) {
  test::GltfBuilder scene = test::unwrapped_scene(test::unwrapped_room());
  scene.add_node({{"mesh", 0}, {"translation", {10, 0, 0}}});
  const PatchModel model = model_of(scene);
  const Lightmap map = place_lightmap(model, {.size = kSize}).lightmap;
  std::size_t left = 0, right = 0;
  for (std::size_t k = 0; k < map.triangle.size(); ++k) {
    if (map.triangle[k] == kNone) continue;
    const float x = model.mesh.position[model.mesh.triangle[map.triangle[k]][0]][0];
    ++(x < 5 ? left : right);
  }
  EXPECT_GT(left, 8000U);
  EXPECT_NEAR(static_cast<double>(left), static_cast<double>(right), 0.1 * left);
}

TEST(Lightmap, MeshesThatOverlapOrLeaveThePageAreLeftOutByName) {
  test::QuadMesh overlapping = test::unwrapped_room(), tiling = test::unwrapped_room();
  overlapping.add({{{5, 0, 0}, {5, 1, 0}, {5, 1, 1}, {5, 0, 1}}}, 2);  // the ceiling's cell
  tiling.texcoord()[0] = -0.2F;
  test::GltfBuilder scene = test::unwrapped_scene(test::unwrapped_room());
  scene.add_node({{"mesh", overlapping.add_to(scene)}, {"translation", {10, 0, 0}}});
  scene.add_node({{"mesh", tiling.add_to(scene)}, {"translation", {20, 0, 0}}});
  scene.root["meshes"][1]["name"] = "Shed";
  scene.root["meshes"][2]["name"] = "Tent";
  const PatchModel model = model_of(scene);
  const PlacedLightmap placed = place_lightmap(model, {.size = kSize});
  ASSERT_EQ(placed.warnings.size(), 2U);
  EXPECT_NE(placed.warnings[0].find("\"Shed\" has second texture coordinates that overlap"),
            std::string::npos)
      << placed.warnings[0];
  EXPECT_NE(placed.warnings[1].find("\"Tent\" has second texture coordinates outside of [0, 1]"),
            std::string::npos)
      << placed.warnings[1];
  for (std::size_t t = 0; t < model.mesh.triangle.size(); ++t) {
    if (placed.lightmap.has_texels[t] == 0) continue;
    EXPECT_LE(model.mesh.position[model.mesh.triangle[t][0]][0], 4.01F);
  }
}

TEST(Lightmap, RefusesWhatCannotHaveOne) {
  test::QuadMesh tiling = test::unwrapped_room();
  tiling.texcoord()[7] = 1.5F;
  const PatchModel bad = model_of(test::unwrapped_scene(tiling));
  test::expect_error([&] { place_lightmap(bad, {.size = kSize}); }, "outside of [0, 1]");
  const PatchModel none = model_of(test::GltfBuilder::triangle());
  test::expect_error([&] { place_lightmap(none, {.size = kSize}); }, "TEXCOORD_1");
  const PatchModel good = model_of(test::unwrapped_scene(test::unwrapped_room()));
  test::expect_error([&] { place_lightmap(good, {.size = 8}); }, "ask for 16 to 4096");
  test::expect_error([&] { place_lightmap(good, {.size = 64, .padding = 65}); }, "padding");
  test::GltfBuilder many = test::unwrapped_scene(test::unwrapped_room());
  for (int k = 1; k < 6; ++k) many.add_node({{"mesh", 0}, {"translation", {10 * k, 0, 0}}});
  const PatchModel six = model_of(many);
  test::expect_error([&] { place_lightmap(six, {.size = 16}); }, "is too small for 6 meshes");
}

TEST(Lightmap, CoordinatesThatAreNotFiniteAreNone) {
  test::QuadMesh mesh = test::unwrapped_room();
  mesh.texcoord()[3] = std::numeric_limits<float>::quiet_NaN();
  const test::TemporaryFolder folder;
  const Scene scene = import_gltf(test::unwrapped_scene(mesh).write_glb(folder));
  EXPECT_TRUE(scene.lightmap_texcoord.empty());
  EXPECT_TRUE(std::ranges::any_of(scene.warnings, [](const std::string& line) {
    return line.find("second texture coordinates") != std::string::npos;
  }));
}

TEST(Lightmap, AFrameDoesNotAllocateAndThreadsDoNotMatter) {
  const TransferData& data = *room();
  const Engine engine = lit(room());
  std::vector<Float3> vertex(data.mesh.position.size()), one(data.lightmap.triangle.size());
  reconstruct_at_vertices(data.mesh, engine.indirect_irradiance(), vertex);
  std::vector<Float3> four(one.size());
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  EXPECT_EQ(
      test::count_allocations([&] { light_at_texels(data.lightmap, data.mesh, vertex, one); }), 0);
  omp_set_num_threads(4);
  light_at_texels(data.lightmap, data.mesh, vertex, four);
  omp_set_num_threads(before);
  EXPECT_EQ(one, four);
  test::expect_error(
      [&] { light_at_texels(data.lightmap, data.mesh, vertex, std::span(one).first(3)); },
      "values at texels");
}

}  // namespace
}  // namespace rebounce::test_lightmap
