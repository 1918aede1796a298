// What the importer makes of an asset: places, orientations, areas, colours, lights, cameras.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <numbers>

#include "precompute/import/import_gltf.h"
#include "precompute/patches/texture_sampling.h"
#include "rebounce/error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce {
namespace {

using test::GltfBuilder;
using test::json;

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

void expect_near(const Float3& actual, const Float3& expected, double tolerance = 1e-6) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance);
}

// A PNG of 2 x 1 pixels: black, then (188, 188, 188).
const std::vector<std::uint8_t> kTwoTexelPng{
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00, 0x00, 0x7b,
    0x40, 0xe8, 0xdd, 0x00, 0x00, 0x00, 0x0f, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60,
    0x60, 0x60, 0xd8, 0xb3, 0x67, 0x0f, 0x00, 0x04, 0x6f, 0x02, 0x35, 0x7b, 0xa1, 0xda, 0x87,
    0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

// A PNG of one pixel: (1, 2, 3).
const std::vector<std::uint8_t> kOneTexelPng{
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
    0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00,
    0x00, 0x90, 0x77, 0x53, 0xde, 0x00, 0x00, 0x00, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78,
    0xda, 0x63, 0x60, 0x64, 0x62, 0x06, 0x00, 0x00, 0x0e, 0x00, 0x07, 0xe9, 0x92, 0x37,
    0xd4, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

class ImportGltf : public ::testing::Test {
 protected:
  Scene import(const GltfBuilder& builder) { return import_gltf(builder.write_glb(folder_)); }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

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
  triangle_.add_node({{"children", {0}}, {"translation", {5, 0, 0}}});
  triangle_.add_node({{"children", {0}}, {"translation", {7, 0, 0}}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.triangle.size(), 2U);
  expect_near(scene.position[0], {5, 0, 0});
  expect_near(scene.position[3], {7, 0, 0});
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

TEST_F(ImportGltf, VertexColoursAreLinear) {
  triangle_.primitive()["attributes"]["COLOR_0"] = triangle_.add_accessor<std::uint8_t>(
      {255, 0, 51, 9, 0, 255, 51, 9, 51, 51, 255, 9}, "VEC4", 4, true);
  const Scene scene = import(triangle_);
  expect_near(scene.vertex_color[0], {1, 0, 0.2F});
  expect_near(scene.vertex_color[2], {0.2F, 0.2F, 1});
  expect_near(
      mean_base_color(scene, scene.materials[0], {},
                      {scene.vertex_color[0], scene.vertex_color[1], scene.vertex_color[2]}),
      {0.4F, 0.4F, 1.4F / 3});
}

TEST_F(ImportGltf, SpecularGlossinessGivesItsDiffuseColour) {
  triangle_.add(
      "materials",
      {{"extensions",
        {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0.25, 0.5, 1, 1}}}}}}});
  triangle_.primitive()["material"] = 0;
  EXPECT_EQ(import(triangle_).materials[0].base_color, (Float3{0.25F, 0.5F, 1}));
}

TEST_F(ImportGltf, EmissionIsInNits) {
  triangle_.add("materials",
                {{"name", "Lamp"},
                 {"doubleSided", true},
                 {"emissiveFactor", {1, 0.5, 0.25}},
                 {"extensions",
                  {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3000000000ULL}}}}}});
  triangle_.primitive()["material"] = 0;
  Scene scene = import(triangle_);
  ASSERT_EQ(scene.materials.size(), 1U);
  EXPECT_EQ(scene.materials[0].name, "Lamp");
  EXPECT_TRUE(scene.materials[0].double_sided);
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{3e9F, 1.5e9F, 0.75e9F}));
  triangle_.root["materials"][0]["extensions"]["KHR_materials_unlit"] = json::object();
  scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{0, 0, 0}));
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_NE(scene.warnings[0].find("emission of 1 unlit"), std::string::npos);
}

TEST_F(ImportGltf, NegativeFactorsAreClampedWithAWarning) {
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {-1, 0.5, 2, 1}}}}});
  triangle_.primitive()["material"] = 0;
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].base_color, (Float3{0, 0.5F, 2}));
  EXPECT_EQ(scene.warnings.size(), 1U);
}

TEST_F(ImportGltf, AlphaAndTransmissionAreTaken) {
  triangle_.add("materials", {{"alphaMode", "MASK"},
                              {"alphaCutoff", 0.25},
                              {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.75}}}}});
  triangle_.add("materials",
                {{"alphaMode", "BLEND"},
                 {"extensions",
                  {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {1, 1, 1, 0.5}}}}}}});
  triangle_.add("materials",
                {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.9}}}}}});
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 7}}}},
                              {"alphaCutoff", -1},
                              {"extensions", {{"KHR_materials_transmission", json::object()}}}});
  const Scene scene = import(triangle_);
  const Material& mask = scene.materials[0];
  EXPECT_EQ(mask.alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(mask.alpha_cutoff, 0.25F);
  EXPECT_EQ(mask.base_alpha, 0.75F);
  EXPECT_EQ(mask.transmission, 0);
  EXPECT_EQ(scene.materials[1].alpha_mode, AlphaMode::kBlend);
  EXPECT_EQ(scene.materials[1].alpha_cutoff, 0.5F);
  EXPECT_EQ(scene.materials[1].base_alpha, 0.5F);
  EXPECT_EQ(scene.materials[2].alpha_mode, AlphaMode::kOpaque);
  EXPECT_EQ(scene.materials[2].transmission, 0.9F);
  EXPECT_EQ(scene.materials[3].base_alpha, 1);
  EXPECT_EQ(scene.materials[3].alpha_cutoff, 0);
  EXPECT_EQ(scene.materials[3].transmission, 0);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ImportGltf, WhatIsSimplifiedOfTransmissionIsCounted) {
  const json glass = {{"transmissionFactor", 0.9}};
  triangle_.add("materials", {{"emissiveFactor", {1, 1, 1}},
                              {"extensions", {{"KHR_materials_transmission", glass}}}});
  triangle_.add("materials",
                {{"extensions", {{"KHR_materials_diffuse_transmission", json::object()}}}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.warnings.size(), 2U);
  EXPECT_TRUE(scene.warnings[0].starts_with("1 materials that emit and transmit"));
  EXPECT_TRUE(scene.warnings[1].starts_with("1 materials that transmit light diffusely"));
}

TEST_F(ImportGltf, UnlitMaterialsAreLitLikeOthers) {
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 1, 1}}}},
                              {"extensions", {{"KHR_materials_unlit", json::object()}}}});
  triangle_.primitive()["material"] = 0;
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].base_color, (Float3{0.25F, 0.5F, 1}));
  EXPECT_EQ(scene.materials[0].emitted_luminance, (Float3{0, 0, 0}));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_EQ(scene.warnings[0], "1 unlit materials are lit like all others");
}

TEST_F(ImportGltf, AlphaOfVertexColoursIsIgnoredWithAWarningWhereItWouldCount) {
  triangle_.primitive()["attributes"]["COLOR_0"] =
      triangle_.add_accessor<float>({1, 1, 1, 1, 1, 1, 1, 0.5, 1, 1, 1, 1}, "VEC4", 4);
  triangle_.add("materials", {{"alphaMode", "OPAQUE"}});
  triangle_.primitive()["material"] = 0;
  EXPECT_TRUE(import(triangle_).warnings.empty());
  triangle_.root["materials"][0]["alphaMode"] = "MASK";
  const auto warnings = import(triangle_).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("alpha of the vertex colours"), std::string::npos) << warnings[0];
}

TEST_F(ImportGltf, VerticesThatNoTriangleUsesAreNotPlaced) {
  std::vector<float> position(300, std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < 9; ++i) position[150 + i] = i == 3 || i == 7 ? 1.0F : 0.0F;
  triangle_.primitive()["attributes"]["POSITION"] = triangle_.add_accessor(position, "VEC3", 3);
  triangle_.primitive()["indices"] = triangle_.add_indices<std::uint8_t>({50, 51, 52});
  triangle_.root["nodes"][0]["scale"] = {2, 2, 2};
  EXPECT_EQ(corners(import(triangle_)), (std::vector<Float3>{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}));
}

/// A triangle with one texture: black on the left, mid-grey (sRGB 188, linear 0.5029) on the right.
class TexturedTriangle : public ImportGltf {
 protected:
  TexturedTriangle() {
    triangle_.primitive()["attributes"]["TEXCOORD_0"] =
        triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2", 2);
    triangle_.primitive()["attributes"]["TEXCOORD_1"] = triangle_.add_accessor<std::uint8_t>(
        {0, 0, 0, 0, 0, 255, 0, 0, 255, 255, 0, 0}, "VEC2", 2, true);
    // Two bytes of padding after each pair.
    triangle_.root["accessors"].back()["count"] = 3;
    triangle_.root["bufferViews"].back()["byteStride"] = 4;
    triangle_.add("images",
                  {{"bufferView", triangle_.add_view(kTwoTexelPng)}, {"mimeType", "image/png"}});
    triangle_.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}});
    triangle_.add("textures", {{"source", 0}, {"sampler", 0}});
    triangle_.add("materials",
                  {{"pbrMetallicRoughness",
                    {{"baseColorFactor", {1, 0.5, 0, 1}}, {"baseColorTexture", {{"index", 0}}}}}});
    triangle_.primitive()["material"] = 0;
  }

  json& base_color_texture() {
    return triangle_.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  }
};

constexpr float kGrey = 0.5029F;

TEST_F(TexturedTriangle, TextureIsKeptEncodedAndDecoded) {
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.textures.size(), 1U);
  ASSERT_EQ(scene.images.size(), 1U);
  EXPECT_EQ(scene.textures[0].encoded[1], 'P');
  EXPECT_EQ(scene.textures[0].wrap_s, TextureWrap::kClampToEdge);
  EXPECT_EQ(scene.textures[0].wrap_t, TextureWrap::kMirroredRepeat);
  EXPECT_EQ(scene.images[0].width, 2);
  EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{0, 0, 0, 255, 188, 188, 188, 255}));
  EXPECT_EQ(scene.materials[0].base_color_texture, 0U);
}

TEST_F(TexturedTriangle, ReflectanceIsAveragedInLinearLight) {
  const Scene scene = import(triangle_);
  // Across the whole width at constant v the two texels count alike: the mean of their linear
  // values, not the linear value of their mean.
  const Float3 mean = mean_base_color(scene, scene.materials[0], {{{0, 0}, {1, 0}, {0.5F, 0}}},
                                      {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
  expect_near(mean, {kGrey / 2, kGrey / 4, 0}, 0.01);
  const Float3 right = mean_base_color(scene, scene.materials[0], {{{1, 0}, {0.8F, 0}, {0.9F, 1}}},
                                       {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
  expect_near(right, {kGrey, kGrey / 2, 0}, 1e-3);
}

TEST_F(TexturedTriangle, TexcoordSetIsChosen) {
  for (const int set : {0, 1}) {
    base_color_texture()["texCoord"] = set;
    const auto texcoord = import(triangle_).base_color_texcoord;
    const std::vector<Float2> first{{0, 0}, {1, 0}, {0, 1}};
    const std::vector<Float2> second{{0, 0}, {0, 1}, {1, 1}};
    EXPECT_EQ(texcoord, set == 0 ? first : second);
  }
}

TEST_F(TexturedTriangle, TextureTransformIsScaleThenRotationThenOffset) {
  base_color_texture()["extensions"]["KHR_texture_transform"] = {{"offset", {0.25, 1}},
                                                                 {"scale", {2, 4}},
                                                                 {"rotation", std::numbers::pi / 2},
                                                                 {"texCoord", 0}};
  base_color_texture()["texCoord"] = 7;
  const Scene scene = import(triangle_);
  // (u, v) -> (4 v + 0.25, -2 u + 1): counter-clockwise as seen with v pointing down.
  const std::array<Float2, 3> expected{{{0.25F, 1}, {0.25F, -1}, {4.25F, 1}}};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(scene.base_color_texcoord[i][0], expected[i][0], 1e-6);
    EXPECT_NEAR(scene.base_color_texcoord[i][1], expected[i][1], 1e-6);
  }
}

TEST_F(TexturedTriangle, EmissiveTextureMultipliesTheLuminance) {
  triangle_.root["materials"][0] = {
      {"emissiveFactor", {1, 1, 1}},
      {"emissiveTexture", {{"index", 0}}},
      {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 100}}}}}};
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.materials[0].emissive_texture, 0U);
  const Float3 bright =
      mean_emitted_luminance(scene, scene.materials[0], {{{0.8F, 0}, {1, 0}, {0.9F, 1}}}, {});
  expect_near(bright, {100 * kGrey, 100 * kGrey, 100 * kGrey}, 0.1);
}

TEST_F(TexturedTriangle, SameImageAndWrapIsOneTexture) {
  triangle_.add("textures", {{"source", 0}, {"sampler", 0}});
  triangle_.add("textures", {{"source", 0}});
  for (const int index : {1, 2}) {
    triangle_.add("materials",
                  {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", index}}}}}});
  }
  const Scene scene = import(triangle_);
  EXPECT_EQ(scene.textures.size(), 2U);
  EXPECT_EQ(scene.materials[1].base_color_texture, 0U);
  EXPECT_EQ(scene.materials[2].base_color_texture, 1U);
}

TEST_F(TexturedTriangle, MissingOrDamagedImageIsWhiteWithAWarning) {
  const std::string text = "not a picture at all";
  const int view = triangle_.add_view(std::vector<char>(text.begin(), text.end()));
  for (const json& image : {json{{"uri", "absent%20picture.png"}}, json{{"bufferView", view}},
                            json::object(), json{{"uri", "data:image/png;base64,AAAA"}}}) {
    triangle_.root["images"][0] = image;
    const Scene scene = import(triangle_);
    EXPECT_EQ(scene.materials[0].base_color_texture, kNone);
    EXPECT_EQ(scene.materials[0].base_color, (Float3{1, 0.5F, 0}));
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_NE(scene.warnings[0].find("images[0]"), std::string::npos) << scene.warnings[0];
  }
}

TEST_F(TexturedTriangle, ImageBesideTheFileMayHaveSpacesInItsName) {
  test::write_bytes(folder_.path() / "a picture.png",
                    std::string(kOneTexelPng.begin(), kOneTexelPng.end()));
  for (const char* uri : {"a%20picture.png", "a picture.png", "./a%20picture.png"}) {
    triangle_.root["images"][0] = {{"uri", uri}};
    const Scene scene = import(triangle_);
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{1, 2, 3, 255}));
  }
}

TEST(TextureSampling, SrgbFollowsIec61966) {
  EXPECT_EQ(srgb_to_linear(0), 0);
  EXPECT_EQ(srgb_to_linear(255), 1);
  EXPECT_NEAR(srgb_to_linear(188), kGrey, 1e-4);
  EXPECT_NEAR(srgb_to_linear(10), 10 / 255.0 / 12.92, 1e-7);
}

TEST(TextureSampling, WrapsAsTheSamplerSays) {
  const Image image{2, 1, {0, 0, 0, 255, 255, 255, 255, 255}};
  const auto at = [&](TextureWrap wrap, float u) {
    return sample_texture({{}, wrap, wrap}, image, {u, 0.5F})[0];
  };
  for (const auto wrap :
       {TextureWrap::kRepeat, TextureWrap::kClampToEdge, TextureWrap::kMirroredRepeat}) {
    EXPECT_FLOAT_EQ(at(wrap, 0.25F), 0);
    EXPECT_FLOAT_EQ(at(wrap, 0.5F), 0.5F);
    EXPECT_FLOAT_EQ(at(wrap, 0.75F), 1);
    for (const float wild : {1e30F, -1e30F, std::nanf(""), INFINITY}) {
      EXPECT_GE(at(wrap, wild), 0);
      EXPECT_LE(at(wrap, wild), 1);
    }
  }
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, 1.25F), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, -0.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kRepeat, 0), 0.5F);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, 1.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, -0.25F), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kMirroredRepeat, 0), 0);
  EXPECT_FLOAT_EQ(at(TextureWrap::kClampToEdge, 1.25F), 1);
  EXPECT_FLOAT_EQ(at(TextureWrap::kClampToEdge, -0.25F), 0);
}

TEST(TextureSampling, BusyTextureIsAveragedWithoutAliasing) {
  // A checkerboard repeated as often as there are sample parts along a side.
  Scene scene;
  scene.images.push_back(
      {2, 2, {0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255}});
  scene.textures.push_back({});
  Material material;
  material.base_color_texture = 0;
  for (const float repeats : {16.0F, 32.0F, 64.0F, 1000.0F}) {
    const Float3 mean = mean_base_color(scene, material, {{{0, 0}, {repeats, 0}, {0, repeats}}},
                                        {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}});
    EXPECT_NEAR(mean[0], 0.5, 0.03) << repeats;
  }
}

json light_node(int light, json node = json::object()) {
  node["extensions"]["KHR_lights_punctual"]["light"] = light;
  return node;
}

TEST_F(ImportGltf, LightsStandWhereTheirNodesAre) {
  triangle_.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.5, 0.25}}, {"intensity", 80}, {"range", 7}},
      {{"type", "spot"},
       {"intensity", 5},
       {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
      {{"type", "directional"}, {"name", "Sun"}}};
  // Turned by -90 degrees about x: -z becomes -y. Scale must not touch the intensity.
  const double half = std::sqrt(0.5);
  triangle_.add_node(light_node(0, {{"name", "Bulb"}, {"translation", {1, 2, 3}}}));
  triangle_.add_node(light_node(
      1, {{"translation", {4, 5, 6}}, {"rotation", {-half, 0, 0, half}}, {"scale", {9, 9, 9}}}));
  triangle_.add_node(light_node(2, {{"scale", {1, 1, -1}}}));
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.lights.size(), 3U);
  const Light& point = scene.lights[0];
  EXPECT_EQ(point.type, LightType::kPoint);
  EXPECT_EQ(point.name, "Bulb");
  expect_near(point.position, {1, 2, 3});
  EXPECT_EQ(point.color, (Float3{1, 0.5F, 0.25F}));
  EXPECT_EQ(point.intensity, 80);
  EXPECT_EQ(point.range, 7);
  const Light& spot = scene.lights[1];
  EXPECT_EQ(spot.type, LightType::kSpot);
  expect_near(spot.position, {4, 5, 6});
  expect_near(spot.direction, {0, -1, 0});
  EXPECT_EQ(spot.intensity, 5);
  EXPECT_EQ(spot.range, 0);
  EXPECT_EQ(spot.inner_cone_angle, 0.25F);
  EXPECT_EQ(spot.outer_cone_angle, 0.5F);
  const Light& sun = scene.lights[2];
  EXPECT_EQ(sun.type, LightType::kDirectional);
  EXPECT_EQ(sun.name, "Sun");
  expect_near(sun.direction, {0, 0, 1});
  EXPECT_EQ(sun.color, (Float3{1, 1, 1}));
  EXPECT_EQ(sun.intensity, 1);
}

TEST_F(ImportGltf, LightsThatCannotBeUsedAreLeftOutWithAWarning) {
  triangle_.root["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"intensity", -1}},
      {{"type", "area"}},
      {{"type", "directional"}},
      {{"type", "point"}, {"color", {1, -1, 1}}}};
  for (int i = 0; i < 4; ++i) triangle_.add_node(light_node(i, {{"scale", {0, 0, 0}}}));
  const Scene scene = import(triangle_);
  EXPECT_TRUE(scene.lights.empty());
  EXPECT_EQ(scene.warnings.size(), 4U);
}

TEST_F(ImportGltf, CamerasLookAlongTheirNodes) {
  triangle_.add("cameras", {{"type", "perspective"},
                            {"name", "View"},
                            {"perspective", {{"yfov", 0.75}, {"znear", 0.1}}}});
  triangle_.add("cameras",
                {{"type", "orthographic"},
                 {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 10}}}});
  // Turned by 90 degrees about y: the camera's -z becomes -x.
  const double half = std::sqrt(0.5);
  triangle_.add_node({{"camera", 0},
                      {"translation", {1, 2, 3}},
                      {"rotation", {0, half, 0, half}},
                      {"scale", {2, 3, 4}}});
  triangle_.add_node({{"camera", 1}});
  const Scene scene = import(triangle_);
  ASSERT_EQ(scene.cameras.size(), 1U);
  const Camera& camera = scene.cameras[0];
  EXPECT_EQ(camera.name, "View");
  expect_near(camera.position, {1, 2, 3});
  expect_near(camera.backward, {1, 0, 0});
  expect_near(camera.up, {0, 1, 0});
  expect_near(camera.right, {0, 0, -1});
  EXPECT_EQ(camera.vertical_fov, 0.75F);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("cameras[1]"), std::string::npos);
}

}  // namespace
}  // namespace rebounce
