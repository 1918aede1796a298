#include "precompute/outputs/receiver_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "precompute/build/transfer_build.h"
#include "precompute/compression/form_factor_compression.h"
#include "precompute/lights/fitting_lights.h"
#include "precompute/outputs/receiver_sets.h"
#include "precompute/outputs/receiver_views.h"
#include "rebounce/outputs.h"
#include "runtime/outputs/vertex_light.h"
#include "runtime/rays/triangle.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/brute_force.h"
#include "tests/support/built_scene.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_scenes.h"
#include "tests/support/with_threads.h"

namespace rebounce::test_receiver_rows {
namespace {

/// A room with nine boxes close to each other, of material 1, all smaller than its patches.
Scene room_of_small_things() {
  Scene scene = test::empty_scene({0.5F, 0.6F, 0.7F});
  scene.materials.resize(2, scene.materials[0]);
  test::add_box(scene, {0, 0, 0}, {3, 2.5, 4}, true);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 low(1 + 0.3 * i, 0.8, 1.2 + 0.3 * k);
      test::add_box(scene, low, low + glm::dvec3(0.2, 0.15 + 0.1 * ((i + k) % 3), 0.2), false, 1);
    }
  }
  return scene;
}

TransferData build(bool with_rows, double tolerance = 0.01) {
  BuildSettings settings;
  settings.subdivision.patch_count = 60;
  settings.form_factors = with_quality(FormFactorQuality::kLow);
  settings.receiver_rows.at_vertices = with_rows;
  settings.receiver_rows.least_error = 0;
  settings.receiver_rows.ray_count = 1024;
  settings.receiver_rows.tolerance = tolerance;
  BuildReport report;
  return build_transfer_data(room_of_small_things(), settings, report);
}

const std::shared_ptr<const TransferData>& room() {
  static const auto data = std::make_shared<const TransferData>(build(true));
  return data;
}

Light lamp() {
  Light light;
  light.position = {0.4F, 1.9F, 0.5F};
  light.intensity = 100;
  return light;
}

/// The error of values at vertices of the boxes, interpolated in the middles of triangles, against
/// rays that bring the radiosity of the patches they meet.
double error_against_rays(const Engine& engine, std::span<const Float3> at_vertices) {
  const DisplayMesh& mesh = engine.data().mesh;
  double off = 0, all = 0;
  for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
    if (mesh.triangle_patch[t] == kNone) continue;
    const TriangleCorners corners = corners_of(mesh, t);
    const Float3 normal = to_float3(front_normal(corners));
    if (mesh.triangle_material[t] != 1) continue;
    const Float3 middle = to_float3((corners[0] + corners[1] + corners[2]) / 3.0);
    const glm::dvec3 truth = test::irradiance_at(
        engine, engine.parts().tracer->offset_point(middle, normal), normal, 1024);
    glm::dvec3 shown(0);
    for (const std::uint32_t v : mesh.triangle[t]) shown += to_dvec3(at_vertices[v]) / 3.0;
    off += area_of(corners) * glm::dot(shown - truth, shown - truth);
    all += area_of(corners) * glm::dot(truth, truth);
  }
  return std::sqrt(off / all);
}

TEST(ReceiverRows, AreNearerToRaysThanWeights) {
  Engine engine(room());
  const Light light = lamp();
  engine.relight({&light, 1}, {});
  std::vector<Float3> rows(room()->mesh.position.size()), weights = rows;
  vertex_irradiance(engine, rows);
  light_at_vertices(room()->mesh, engine.indirect_irradiance(), weights);
  const double with_rows = error_against_rays(engine, rows);
  const double with_weights = error_against_rays(engine, weights);
  std::printf("relative L2 error: %.4f with rows, %.4f with weights\n", with_rows, with_weights);
  EXPECT_LT(with_rows, 0.8 * with_weights);
}

TEST(ReceiverRows, AddNothingUnderEvenLight) {
  const ReceiverRows& rows = room()->receiver_rows;
  ASSERT_GT(rows.group_count(), 0U);
  const std::vector<Float3> even(room()->patches.size(), Float3{1, 1, 1});
  std::vector<Float3> added(room()->mesh.position.size(), Float3{0, 0, 0});
  ReceiverProducts(rows, room()->patches.area).add(even, added);
  for (const Float3& a : added) EXPECT_NEAR(a[0], 0, 1e-3);
}

TEST(ReceiverRows, ChangeNothingElse) {
  const TransferData without = build(false);
  EXPECT_TRUE(without.receiver_rows.empty());
  EXPECT_EQ(without.mesh.weight, room()->mesh.weight);
  EXPECT_EQ(without.patches.area, room()->patches.area);
  // At patches alone, vertices show what the operator gives, by their weights.
  const auto plain = std::make_shared<const TransferData>(without);
  Engine engine(plain), other(room());
  const Light light = lamp();
  engine.relight({&light, 1}, {});
  other.relight({&light, 1}, {});
  EXPECT_TRUE(std::ranges::equal(engine.radiosity(), other.radiosity()));
  std::vector<Float3> shown(plain->mesh.position.size()), weighted = shown;
  vertex_irradiance(engine, shown);
  light_at_vertices(plain->mesh, engine.indirect_irradiance(), weighted);
  EXPECT_EQ(shown, weighted);
}

TEST(ReceiverRows, AreTheSameOnAnyNumberOfThreads) {
  const TransferData again = test::with_threads(1, [] { return build(true); });
  const TransferData more = test::with_threads(4, [] { return build(true); });
  EXPECT_EQ(again.receiver_rows.value, more.receiver_rows.value);
  EXPECT_EQ(again.receiver_rows.scale, more.receiver_rows.scale);
  EXPECT_EQ(again.receiver_rows.receiver, more.receiver_rows.receiver);
  EXPECT_EQ(again.receiver_rows.entry_set, more.receiver_rows.entry_set);
  EXPECT_EQ(again.receiver_rows.set, more.receiver_rows.set);
}

TEST(ReceiverRows, AFrameWithThemDoesNotAllocate) {
  Engine engine(room());
  const Light light = lamp();
  std::vector<Float3> shown(room()->mesh.position.size());
  engine.relight({&light, 1}, {});
  EXPECT_EQ(test::count_allocations([&] {
              engine.relight({&light, 1}, {});
              vertex_irradiance(engine, shown);
            }),
            0);
}

TEST(ReceiverRows, AreOnlyStoredWhereTheyAddMoreThanTheTolerance) {
  EXPECT_EQ(build(true, 10).receiver_rows.group_count(), 0U);
}

/// m² of the surface that each vertex stands for.
std::vector<double> vertex_areas(const DisplayMesh& mesh) {
  std::vector<double> area(mesh.position.size());
  for (std::uint32_t t = 0; t < mesh.surface_count(); ++t) {
    if (mesh.triangle_patch[t] == kNone) continue;
    for (const std::uint32_t v : mesh.triangle[t]) area[v] += area_of(corners_of(mesh, t)) / 3;
  }
  return area;
}

/// What rows add at the vertices under lights that operators are fitted to: root mean square over
/// the surface, relative to the light of the patches; the median over 32 of them.
double added_by(const TransferData& data) {
  const std::vector<double> share = vertex_areas(data.mesh);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const std::vector<std::vector<Float3>> lights =
      draw_fitting_lights(data, tracer, 1, data.transfer->roles()).training;
  ReceiverProducts rows(data.receiver_rows, data.patches.area);
  std::vector<float> workspace(data.transfer->workspace_size());
  std::vector<double> parts;
  for (std::size_t k = 0; k < 32; ++k) {
    const std::vector<Float3>& light = lights[k * lights.size() / 32];
    std::vector<Float3> arrives(light.size()), added(share.size());
    data.transfer->apply(light, arrives, workspace);
    const std::vector<std::vector<Float3>> radiosity =
        radiosities_of(*data.transfer, data.patches.reflectance, {&light, 1});
    rows.add(radiosity[0], added);
    double off = 0, all = 0;
    const auto mean = [](const Float3& v) { return (double{v[0]} + v[1] + v[2]) / 3; };
    for (std::size_t v = 0; v < share.size(); ++v) off += share[v] * std::pow(mean(added[v]), 2);
    for (std::size_t i = 0; i < light.size(); ++i)
      all += data.patches.area[i] * std::pow(mean(arrives[i]), 2);
    parts.push_back(std::sqrt(off / all));
  }
  std::ranges::sort(parts);
  return parts[parts.size() / 2];
}

TEST(ReceiverRows, AreMadeWhereVerticesErrByMoreWithoutThem) {
  TransferData data = build(false);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const auto make = [&](double least_error) {
    const VertexReceivers vertices(data, data.mesh.triangle_patch);
    const ReceiverRowSettings settings{
        .least_error = least_error, .tolerance = 0, .most_sets = 1024};
    return make_receiver_rows(data, data.mesh.triangle_patch, vertices, tracer, settings, 1);
  };
  MadeReceiverRows made = make(0.02);
  ASSERT_GT(made.rows.group_count(), 0U);
  ASSERT_TRUE(made.error_without.has_value());
  data.receiver_rows = std::move(made.rows);
  EXPECT_NEAR(*made.error_without / added_by(data), 1, 0.05);
  const MadeReceiverRows none = make(1.01 * *made.error_without);
  EXPECT_TRUE(none.rows.empty());
  EXPECT_EQ(none.error_without, made.error_without);
}

TEST(ReceiverRows, AreMadeByDefaultInScenesFullOfSmallThings) {
  BuildSettings settings;
  settings.subdivision.patch_count = 500;
  settings.form_factors = with_quality(FormFactorQuality::kLow);
  BuildReport report;
  const TransferData rooms = test::built_scene("three_rooms.gltf", settings, report);
  EXPECT_GT(report.error_without_rows.value_or(0), settings.receiver_rows.least_error);
  EXPECT_GT(rooms.receiver_rows.group_count(), 0U);

  BuildReport of_box;  // whose vertices are hardly ever smaller than patches
  EXPECT_TRUE(test::built_scene("white_room.gltf", settings, of_box).receiver_rows.empty());
  EXPECT_FALSE(of_box.error_without_rows.has_value());
  settings.operator_kind = OperatorKind::kNoOperator;
  EXPECT_TRUE(test::built_scene("three_rooms.gltf", settings, of_box).receiver_rows.empty());
}

TEST(ReceiverRows, RefuseWhatCannotBe) {
  const TransferData data = build(false);
  const RayTracer tracer = make_surface_tracer(data.mesh);
  const auto make = [&](const TransferData& from, const ReceiverRowSettings& settings) {
    const VertexReceivers vertices(from, from.mesh.triangle_patch);
    make_receiver_rows(from, from.mesh.triangle_patch, vertices, tracer, settings, 1);
  };
  test::expect_error([&] { make(data, {.ray_count = 63}); }, "ray_count must be at least 64");
  test::expect_error([&] { make(data, {.tolerance = -1}); }, "tolerance");
  test::expect_error([&] { make(data, {.tolerance = NAN}); }, "tolerance");
  test::expect_error([&] { make(data, {.least_error = -1}); }, "must be at least 0");
  test::expect_error([&] { make(data, {.least_error = NAN}); }, "must be at least 0");
  test::expect_error([&] { make(data, {.most_sets = 3}); }, "from 4");
  test::expect_error([&] { make(data, {.most_sets = 1025}); }, "1024");
  TransferData without = data;
  without.transfer = nullptr;
  test::expect_error([&] { make(without, {}); }, "need an operator");
}

/// A floor of patch 0, 2 m by 1 m. A shelf of patch 1 covers it from x = 1 on, at a height of 2 cm;
/// far above is a ceiling of patch 2.
struct Shelf {
  DisplayMesh mesh;

  Shelf() {
    add_rectangle({0, 1}, {0, 1}, 0, true, 0);
    add_rectangle({1, 2}, {0, 1}, 0, true, 0);
    add_rectangle({1, 9}, {-8, 9}, 0.02F, false, 1);
    add_rectangle({-50, 50}, {-50, 50}, 4, false, 2);
    mesh.back_triangle.assign(mesh.triangle.size(), kNone);
  }

  /// The part of patch `seen` in the row of the vertex at the corner `x` of the floor.
  float part(float x, std::uint32_t seen) const {
    const RayTracer tracer = make_surface_tracer(mesh);
    ReceiverViewer viewer(mesh, mesh.triangle_patch, 3, tracer, 4096);
    std::uint32_t vertex = 0;
    std::vector<std::uint32_t> around;
    for (std::uint32_t t = 0; t < 4; ++t) {
      for (const std::uint32_t v : mesh.triangle[t]) {
        if (mesh.position[v] != Float3{x, 0, 0}) continue;
        vertex = v;
        around.push_back(t);
      }
    }
    ViewRow row;
    viewer.look_from_vertex(vertex, around, 1, row);
    for (const auto& [patch, part] : row) {
      if (patch == seen) return part;
    }
    return 0;
  }

 private:
  /// The vertices of the floor are shared.
  std::uint32_t vertex_at(const Float3& place) {
    const auto found = std::ranges::find(mesh.position, place);
    if (found == mesh.position.end()) mesh.position.push_back(place);
    return static_cast<std::uint32_t>(std::ranges::find(mesh.position, place) -
                                      mesh.position.begin());
  }

  /// A level rectangle that faces up or down.
  void add_rectangle(const Float2& x, const Float2& z, float y, bool is_up, std::uint32_t patch) {
    const std::uint32_t a = vertex_at({x[0], y, z[0]}), b = vertex_at({x[0], y, z[1]});
    const std::uint32_t c = vertex_at({x[1], y, z[1]}), d = vertex_at({x[1], y, z[0]});
    mesh.triangle.push_back(is_up ? Uint3{a, b, c} : Uint3{a, c, b});
    mesh.triangle.push_back(is_up ? Uint3{a, c, d} : Uint3{a, d, c});
    mesh.triangle_patch.insert(mesh.triangle_patch.end(), 2, patch);
  }
};

TEST(ReceiverViews, AVertexAtTheBorderOfACoverShowsWhatIsSeen) {
  const Shelf shelf;
  // If all of its triangles counted alike, half would be the shelf's. Some of it is seen at its
  // rim.
  EXPECT_GT(shelf.part(1, 2), 0.8 * shelf.part(0, 2));
  EXPECT_LT(shelf.part(1, 1), 0.2);
}

TEST(ReceiverViews, AVertexUnderACoverShowsItsOwnLight) {
  const Shelf shelf;
  EXPECT_GT(shelf.part(2, 1), 0.5);
  EXPECT_LT(shelf.part(2, 2), 0.5);
}

/// Patches of a strip, and receivers that see some of them.
struct Strip {
  PatchTable patches;
  GroupRows rows;
  std::vector<std::vector<Float3>> light;

  Strip() {
    for (int i = 0; i < 64; ++i) {
      patches.area.push_back(1);
      patches.centroid.push_back({static_cast<float>(i), 0, 0});
      patches.normal.push_back({0, 1, 0});
      patches.reflectance.push_back({0.5F, 0.5F, 0.5F});
    }
    light.assign(1, std::vector<Float3>(64, Float3{1, 1, 1}));
    for (std::uint32_t p = 0; p < 64; p += 2) rows.position.push_back(p);
    rows.part.setConstant(4, 32, 0.01F);
    rows.part.row(1) *= -1;
    rows.part(2, 5) = 0.3F;
    rows.light.setOnes(1);
  }
};

TEST(ReceiverSets, CoverWhatIsSeenOnce) {
  const Strip strip;
  const ReceiverSources sources(strip.patches, strip.light);
  for (const std::uint32_t most : {4U, 9U, 64U}) {
    const auto sets = choose_sets(sources, strip.rows, {0, most, 1});
    EXPECT_LE(sets.size(), most);
    std::vector<int> covered(64, 0);
    std::uint32_t end = 0;
    for (const std::uint32_t s : sets) {
      const Cluster& cluster = sources.tree.clusters[s];
      EXPECT_GE(cluster.begin, end);
      end = cluster.begin + cluster.count;
      for (std::uint32_t p = cluster.begin; p < end; ++p) ++covered[p];
    }
    for (const std::uint32_t p : strip.rows.position) EXPECT_EQ(covered[p], 1);
  }
}

TEST(ReceiverSets, SinglePatchesWithLargeDifferencesGetSetsOfTheirOwn) {
  const Strip strip;
  const ReceiverSources sources(strip.patches, strip.light);
  // Even light alone shows no need of it: no set errs.
  EXPECT_EQ(choose_sets(sources, strip.rows, {1e-6, 16, 0}).size(), 1U);
  const auto sets = choose_sets(sources, strip.rows, {0, 16, 1});
  const auto is_alone = [&](std::uint32_t s) {
    return sources.tree.clusters[s].begin == strip.rows.position[5] &&
           sources.tree.clusters[s].count == 1;
  };
  EXPECT_TRUE(std::ranges::any_of(sets, is_alone));
}

}  // namespace
}  // namespace rebounce::test_receiver_rows
