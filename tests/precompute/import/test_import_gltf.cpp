// What the importer makes of the geometry of an asset: places, orientations, areas.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <vector>

#include "rebounce/error.h"
#include "tests/precompute/import/imported_triangle.h"

namespace rebounce::test_import_gltf {
namespace {

using test::expect_near;
using test::GltfBuilder;
using test::json;
using ImportGltf = test::ImportedTriangle;

glm::dvec3 vec(const Float3& v) {
  return {v[0], v[1], v[2]};
}

// Twice the area times the geometric normal.
glm::dvec3 area_vector(const Scene& scene, const Uint3& triangle) {
  const glm::dvec3 a = vec(scene.position[triangle[0]]);
  return glm::cross(vec(scene.position[triangle[1]]) - a, vec(scene.position[triangle[2]]) - a);
}

double total_area(const Scene& scene) {
  double area = 0;
  for (const Uint3& triangle : scene.triangle) {
    area += glm::length(area_vector(scene, triangle)) / 2;
  }
  return area;
}

// The volume that the triangles enclose; negative where their fronts look inwards.
double enclosed_volume(const Scene& scene) {
  double volume = 0;
  for (const Uint3& triangle : scene.triangle) {
    volume += glm::dot(area_vector(scene, triangle), vec(scene.position[triangle[0]])) / 6;
  }
  return volume;
}

// The corners of the triangles, one after another.
std::vector<Float3> corners(const Scene& scene) {
  std::vector<Float3> result;
  for (const Uint3& triangle : scene.triangle) {
    for (const std::uint32_t vertex : triangle) result.push_back(scene.position[vertex]);
  }
  return result;
}

// The cube [0, 1]^3 with its normals outwards, vertices shared between faces.
GltfBuilder cube() {
  GltfBuilder builder;
  std::vector<float> position;
  std::vector<float> normal;
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      position.push_back(i & bit ? 1.0F : 0.0F);
      normal.push_back(i & bit ? 0.57735027F : -0.57735027F);
    }
  }
  const std::vector<std::uint8_t> index{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  const int positions = builder.add_accessor(position, "VEC3", 3);
  const int normals = builder.add_accessor(normal, "VEC3", 3);
  const int indices = builder.add_indices(index);
  builder.add_mesh(
      {{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}, {"indices", indices}});
  builder.add_node({{"mesh", 0}});
  return builder;
}

// Every vertex normal is on the front side of the triangles that use it.
void expect_normals_in_front(const Scene& scene) {
  for (const Uint3& triangle : scene.triangle) {
    for (const std::uint32_t vertex : triangle) {
      EXPECT_GT(glm::dot(vec(scene.normal[vertex]), area_vector(scene, triangle)), 0);
    }
  }
}

TEST_F(ImportGltf, TakesATriangleAsItIs) {
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.name, "scene.glb");
  ASSERT_EQ(scene.triangle.size(), 1U);
  EXPECT_EQ(corners(scene), (std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  for (const Float3& normal : scene.normal) expect_near(normal, {0, 0, 1});
  for (const Float3& color : scene.vertex_color) EXPECT_EQ(color, (Float3{1, 1, 1}));
  ASSERT_EQ(scene.materials.size(), 1U);
  EXPECT_EQ(scene.materials[0].base_color, (Float3{1, 1, 1}));
  EXPECT_TRUE(scene.warnings.empty());
  EXPECT_EQ(scene.hash, import(triangle_).hash);
}

TEST_F(ImportGltf, HashCoversTheFileAndItsBuffers) {
  const auto path = triangle_.write_gltf(folder_);
  const std::string before = import_gltf(path).hash;
  EXPECT_TRUE(before.starts_with("xxh3:"));
  EXPECT_EQ(before.size(), 37U);
  std::string changed = triangle_.binary;
  changed[2] = 1;
  test::write_bytes(folder_.path() / "scene.bin", changed);
  EXPECT_NE(import_gltf(path).hash, before);
}

TEST_F(ImportGltf, MirroredNodeKeepsItsFrontOutside) {
  GltfBuilder builder = cube();
  EXPECT_NEAR(enclosed_volume(import(builder)), 1, 1e-12);
  for (const std::array<double, 3>& scale :
       {std::array<double, 3>{-2, 3, 4}, {2, -3, 4}, {-2, -3, -4}, {-2, -3, 4}, {2, 3, 4}}) {
    builder.root["nodes"][0]["scale"] = scale;
    const Scene scene = import(builder);
    EXPECT_NEAR(enclosed_volume(scene), 24, 1e-5);
    EXPECT_NEAR(total_area(scene), 2 * (6 + 8 + 12), 1e-5);
    expect_normals_in_front(scene);
  }
}

TEST_F(ImportGltf, NormalsFollowTheInverseTranspose) {
  // The plane x + y = 1, stretched along x: its normal turns towards y.
  triangle_.primitive()["attributes"]["POSITION"] =
      triangle_.add_accessor<float>({1, 0, 0, 0, 1, 0, 0, 1, 1}, "VEC3", 3);
  const float half = std::sqrt(0.5F);
  triangle_.primitive()["attributes"]["NORMAL"] =
      triangle_.add_accessor<float>({half, half, 0, half, half, 0, half, half, 0}, "VEC3", 3);
  triangle_.root["nodes"][0]["scale"] = {3, 1, 1};
  const float length = std::sqrt(10.0F);
  for (const Float3& normal : import(triangle_).normal) {
    expect_near(normal, {1 / length, 3 / length, 0});
  }
}

TEST_F(ImportGltf, FlattenedNodeKeepsWhatHasArea) {
  GltfBuilder builder = cube();
  builder.root["nodes"][0]["scale"] = {1, 1, 0};
  const Scene scene = import(builder);
  EXPECT_EQ(scene.triangle.size(), 4U);
  EXPECT_EQ(scene.degenerate_triangle_count, 8U);
  EXPECT_NEAR(total_area(scene), 2, 1e-12);
  expect_normals_in_front(scene);
}

TEST_F(ImportGltf, TransformsComposeDownTheHierarchy) {
  // Turned by 90 degrees about z, then moved; the parent scales by 2 (as a matrix, column by
  // column) and moves upwards.
  const double half = std::sqrt(0.5);
  triangle_.root["nodes"][0] = {
      {"mesh", 0}, {"rotation", {0, 0, half, half}}, {"translation", {10, 0, 0}}};
  triangle_.add_node(
      {{"children", {0}}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 5, 0, 1}}});
  const Scene scene = import(triangle_);
  expect_near(scene.position[0], {20, 5, 0}, 1e-5);
  expect_near(scene.position[1], {20, 7, 0}, 1e-5);
  expect_near(scene.position[2], {18, 5, 0}, 1e-5);
}

TEST_F(ImportGltf, HierarchyMayBeVeryDeep) {
  constexpr int kDepth = 200000;
  for (int i = 1; i < kDepth; ++i) triangle_.add_node({{"children", {i - 1}}});
  triangle_.root["nodes"][kDepth - 1]["translation"] = {1, 2, 3};
  expect_near(import(triangle_).position[0], {1, 2, 3});
}

TEST_F(ImportGltf, NodeWithTwoParentsStandsBelowBoth) {
  triangle_.primitive()["attributes"]["TEXCOORD_1"] =
      triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2", 2);
  triangle_.add_node({{"children", {0}}, {"translation", {5, 0, 0}}});
  triangle_.add_node({{"children", {0}}, {"translation", {7, 0, 0}}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.triangle.size(), 2U);
  expect_near(scene.position[0], {5, 0, 0});
  expect_near(scene.position[3], {7, 0, 0});
  ASSERT_EQ(scene.lightmap_page.size(), 2U);
  EXPECT_EQ(scene.lightmap_texcoord[0].page, 0U);
  EXPECT_EQ(scene.lightmap_texcoord[3].page, 1U);
}

TEST_F(ImportGltf, TakesTheSceneThatIsNamed) {
  triangle_.add_node({{"mesh", 0}, {"translation", {9, 0, 0}}});
  triangle_.root["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  expect_near(import(triangle_).position[0], {0, 0, 0});
  triangle_.root["scene"] = 1;
  expect_near(import(triangle_).position[0], {9, 0, 0});
}

/// Two triangles that make a square, in one of the ways in which glTF can write them.
class SquareWays : public ImportGltf {
 protected:
  static constexpr std::array<float, 12> kCorner{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

  static std::vector<float> positions(const std::vector<int>& order) {
    std::vector<float> values;
    for (const int corner : order) {
      for (int i = 0; i < 3; ++i) {
        values.push_back(
            kCorner[3 * static_cast<std::size_t>(corner) + static_cast<std::size_t>(i)]);
      }
    }
    return values;
  }

  static GltfBuilder builder_with(const json& primitive_extra, int position, GltfBuilder builder) {
    json primitive{{"attributes", {{"POSITION", position}}}};
    primitive.update(primitive_extra);
    builder.add_mesh(primitive);
    builder.add_node({{"mesh", 0}});
    return builder;
  }

  void expect_square(const GltfBuilder& builder) {
    const Scene scene = import(builder);
    EXPECT_EQ(
        corners(scene),
        (std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
    for (const Float3& normal : scene.normal) expect_near(normal, {0, 0, 1});
  }

  template <typename Index>
  void expect_indexed_square() {
    GltfBuilder builder;
    const int position = builder.add_accessor(positions({0, 1, 2, 3}), "VEC3", 3);
    const int indices = builder.add_indices<Index>({0, 1, 2, 1, 3, 2});
    expect_square(builder_with({{"indices", indices}}, position, builder));
  }
};

TEST_F(SquareWays, NotIndexed) {
  GltfBuilder builder;
  const int position = builder.add_accessor(positions({0, 1, 2, 1, 3, 2}), "VEC3", 3);
  expect_square(builder_with(json::object(), position, builder));
}

TEST_F(SquareWays, Indexed) {
  expect_indexed_square<std::uint8_t>();
  expect_indexed_square<std::uint16_t>();
  expect_indexed_square<std::uint32_t>();
}

TEST_F(SquareWays, StripAndFan) {
  GltfBuilder strip;
  int position = strip.add_accessor(positions({0, 1, 2, 3}), "VEC3", 3);
  expect_square(builder_with({{"mode", 5}}, position, strip));
  // A fan names its first vertex last: (1, 2, 0) of 2, 0, 1, 3 would start the square elsewhere, so
  // only its area and front are compared.
  GltfBuilder fan;
  position = fan.add_accessor(positions({0, 1, 3, 2}), "VEC3", 3);
  const Scene scene = import(builder_with({{"mode", 6}}, position, fan));
  EXPECT_EQ(corners(scene), (std::vector<Float3>{
                                {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}}));
}

TEST_F(SquareWays, Interleaved) {
  GltfBuilder builder;
  std::vector<float> interleaved;
  const auto position = positions({0, 1, 2, 3});
  for (std::size_t vertex = 0; vertex < 4; ++vertex) {
    interleaved.insert(interleaved.end(), {0, 0, 1});
    interleaved.insert(interleaved.end(), &position[3 * vertex], &position[3 * vertex] + 3);
  }
  const int view = builder.add_view(interleaved, 24);
  const json accessor{
      {"bufferView", view}, {"componentType", test::kFloat}, {"count", 4}, {"type", "VEC3"}};
  const int normals = builder.add("accessors", accessor);
  const int positions_accessor = builder.add("accessors", accessor);
  builder.root["accessors"][positions_accessor]["byteOffset"] = 12;
  const int indices = builder.add_indices<std::uint16_t>({0, 1, 2, 1, 3, 2});
  GltfBuilder complete = builder_with({{"indices", indices}}, positions_accessor, builder);
  complete.primitive()["attributes"]["NORMAL"] = normals;
  expect_square(complete);
}

TEST_F(SquareWays, Sparse) {
  // All zeros but for three vertices; once without any base, once over wrong values.
  for (const bool with_base : {false, true}) {
    GltfBuilder builder;
    const int replaced = builder.add_view<std::uint8_t>({1, 2, 3});
    const int values = builder.add_view(positions({1, 2, 3}));
    json accessor{{"componentType", test::kFloat},
                  {"count", 4},
                  {"type", "VEC3"},
                  {"sparse",
                   {{"count", 3},
                    {"indices", {{"bufferView", replaced}, {"componentType", test::kUnsignedByte}}},
                    {"values", {{"bufferView", values}}}}}};
    if (with_base) accessor["bufferView"] = builder.add_view(positions({0, 0, 1, 2}));
    const int position = builder.add("accessors", accessor);
    const int indices = builder.add_indices<std::uint16_t>({0, 1, 2, 1, 3, 2});
    expect_square(builder_with({{"indices", indices}}, position, builder));
  }
}

template <typename T>
std::vector<T> scaled(const std::vector<float>& values, float factor) {
  std::vector<T> result;
  for (const float value : values) result.push_back(static_cast<T>(value * factor));
  return result;
}

TEST_F(SquareWays, Quantized) {
  const auto corner = positions({0, 1, 2, 1, 3, 2});
  const auto expect = [&](auto type, float factor, bool normalized) {
    using T = decltype(type);
    GltfBuilder builder;
    // The stride of tightly packed 8 and 16-bit positions needs no multiple of 4 to be read.
    const int position = builder.add_accessor(scaled<T>(corner, factor), "VEC3", 3, normalized);
    GltfBuilder complete = builder_with(json::object(), position, builder);
    if (!normalized) {
      const double size = 1.0 / static_cast<double>(factor);
      complete.root["nodes"][0]["scale"] = {size, size, size};
    }
    expect_square(complete);
  };
  expect(std::int8_t{}, 127, true);
  expect(std::uint8_t{}, 255, true);
  expect(std::int16_t{}, 32767, true);
  expect(std::uint16_t{}, 65535, true);
  expect(std::int8_t{}, 64, false);
  expect(std::uint8_t{}, 128, false);
  expect(std::int16_t{}, 1024, false);
  expect(std::uint16_t{}, 2048, false);
}

TEST_F(ImportGltf, SizesMayBeWrittenAsReals) {
  triangle_.root["accessors"][0]["count"] = 3.0;
  EXPECT_EQ(import(triangle_).triangle.size(), 1U);
}

TEST_F(ImportGltf, PointsAndLinesAreSkippedAndCounted) {
  json& primitives = triangle_.root["meshes"][0]["primitives"];
  for (int mode = 0; mode < 4; ++mode) {
    primitives.push_back({{"attributes", {{"POSITION", 0}}}, {"mode", mode}});
  }
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.triangle.size(), 1U);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("4 primitives"), std::string::npos) << scene.warnings[0];
}

TEST_F(ImportGltf, SkinsAndMorphTargetsAreCounted) {
  triangle_.root["nodes"][0]["skin"] = 0;
  triangle_.primitive()["targets"] = json::array({{{"POSITION", 0}}});
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.triangle.size(), 1U);
  EXPECT_EQ(scene.warnings,
            (std::vector<std::string>{
                "1 skinned meshes stand as their nodes place them, without their skin",
                "1 primitives with morph targets are taken in their base shape"}));
}

TEST_F(ImportGltf, DegenerateTrianglesAreDroppedAndCounted) {
  // A repeated index, a repeated position, three points in a line; then one with an area.
  triangle_.primitive()["attributes"]["POSITION"] =
      triangle_.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 3, 0, 0}, "VEC3", 3);
  triangle_.primitive()["indices"] =
      triangle_.add_indices<std::uint16_t>({0, 1, 1, 0, 1, 3, 0, 1, 4, 0, 1, 2});
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.triangle.size(), 1U);
  EXPECT_EQ(scene.degenerate_triangle_count, 3U);
  EXPECT_EQ(scene.position.size(), 3U);
}

TEST_F(ImportGltf, ThinButRealTrianglesStay) {
  triangle_.root["nodes"][0]["scale"] = {1, 1e-5, 1};
  EXPECT_EQ(import(triangle_).triangle.size(), 1U);
}

TEST_F(ImportGltf, BadNormalsAreRepaired) {
  const float nan = std::nanf("");
  triangle_.primitive()["attributes"]["NORMAL"] =
      triangle_.add_accessor<float>({0, 0, 0, nan, 0, 1, 3, 0, 4}, "VEC3", 3);
  const Scene scene = import(triangle_);
  expect_near(scene.normal[0], {0, 0, 1});
  expect_near(scene.normal[1], {0, 0, 1});
  expect_near(scene.normal[2], {0.6F, 0, 0.8F});
}

TEST_F(ImportGltf, VerticesThatNoTriangleUsesAreNotPlaced) {
  std::vector<float> position(300, std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < 9; ++i) position[150 + i] = i == 3 || i == 7 ? 1.0F : 0.0F;
  triangle_.primitive()["attributes"]["POSITION"] = triangle_.add_accessor(position, "VEC3", 3);
  triangle_.primitive()["indices"] = triangle_.add_indices<std::uint8_t>({50, 51, 52});
  triangle_.root["nodes"][0]["scale"] = {2, 2, 2};
  EXPECT_EQ(corners(import(triangle_)), (std::vector<Float3>{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}));
}

}  // namespace
}  // namespace rebounce::test_import_gltf
