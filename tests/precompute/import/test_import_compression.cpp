// Draco and meshopt compression: what is decoded is what was encoded, and nothing that a file
// claims of it is believed.

#include <draco/compression/encode.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <random>

#include "precompute/import/import_gltf.h"
#include "tests/support/expect_error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce::test_import_compression {
namespace {

using test::GltfBuilder;
using test::json;

// A bumpy sheet of 2 x 8 x 8 triangles, its vertices shared.
constexpr int kSide = 8;

std::vector<float> sheet_positions() {
  std::vector<float> position;
  for (int row = 0; row <= kSide; ++row) {
    for (int column = 0; column <= kSide; ++column) {
      position.insert(position.end(), {static_cast<float>(column), static_cast<float>(row),
                                       static_cast<float>((row * 5 + column * 3) % 7) / 4});
    }
  }
  return position;
}

std::vector<std::uint32_t> sheet_indices() {
  std::vector<std::uint32_t> index;
  for (std::uint32_t row = 0; row < kSide; ++row) {
    for (std::uint32_t column = 0; column < kSide; ++column) {
      const std::uint32_t a = row * (kSide + 1) + column;
      const std::uint32_t b = a + kSide + 1;
      index.insert(index.end(), {a, a + 1, b, b, a + 1, b + 1});
    }
  }
  return index;
}

constexpr std::size_t kVertexCount = (kSide + 1) * (kSide + 1);
constexpr std::size_t kIndexCount = 6 * kSide * kSide;

// The corners of the triangles, each triangle from its smallest corner, sorted.
std::vector<std::array<Float3, 3>> sorted_triangles(const Scene& scene) {
  std::vector<std::array<Float3, 3>> triangles;
  for (const Uint3& triangle : scene.triangle) {
    std::array<Float3, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) corner[k] = scene.position[triangle[k]];
    std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end()), corner.end());
    triangles.push_back(corner);
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

class Compression : public ::testing::Test {
 protected:
  static std::filesystem::path write(const GltfBuilder& builder, const test::TemporaryFolder& to) {
    return builder.write_glb(to);
  }

  Scene import(const GltfBuilder& builder) { return import_gltf(write(builder, folder_)); }

  void expect_refused(const GltfBuilder& builder, const std::string& named) {
    const auto path = write(builder, folder_);
    test::expect_error([&] { import_gltf(path); }, named);
  }

  // The sheet, uncompressed.
  Scene plain() {
    GltfBuilder builder;
    const int position = builder.add_accessor(sheet_positions(), "VEC3", 3);
    const int index = builder.add_indices(sheet_indices());
    builder.add_mesh({{"attributes", {{"POSITION", position}}}, {"indices", index}});
    builder.add_node({{"mesh", 0}});
    return import(builder);
  }

  // Imports `builder` with each byte of its buffer damaged in turn: it must be read or refused.
  void damage_every_byte(const GltfBuilder& builder) {
    int refused = 0;
    std::mt19937 random(20240611);
    for (std::size_t i = 0; i < builder.binary.size(); ++i) {
      GltfBuilder damaged = builder;
      damaged.binary[i] ^= static_cast<char>(1 + random() % 255);
      try {
        import(damaged);
      } catch (const Error&) {
        ++refused;
      }
    }
    EXPECT_GT(refused, 10);
  }

  test::TemporaryFolder folder_;
};

// ---- Draco

struct DracoOptions {
  int method = draco::MESH_EDGEBREAKER_ENCODING;
  bool quantized = false;
  bool with_metadata = false;
};

std::vector<char> draco_bytes(const DracoOptions& options, std::uint32_t unique_id) {
  const auto position = sheet_positions();
  const auto index = sheet_indices();
  draco::Mesh mesh;
  mesh.set_num_points(kVertexCount);
  draco::GeometryAttribute description;
  description.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
  const int attribute = mesh.AddAttribute(description, true, kVertexCount);
  mesh.attribute(attribute)->set_unique_id(unique_id);
  for (std::uint32_t i = 0; i < kVertexCount; ++i) {
    mesh.attribute(attribute)->SetAttributeValue(draco::AttributeValueIndex(i), &position[3 * i]);
  }
  for (std::uint32_t f = 0; f < kIndexCount / 3; ++f) {
    mesh.AddFace({draco::PointIndex(index[3 * f]), draco::PointIndex(index[3 * f + 1]),
                  draco::PointIndex(index[3 * f + 2])});
  }
  if (options.with_metadata) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryString("name", "sheet");
    mesh.AddMetadata(std::move(metadata));
  }
  draco::Encoder encoder;
  encoder.SetEncodingMethod(options.method);
  if (options.quantized) {
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  }
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
  return {buffer.data(), buffer.data() + buffer.size()};
}

class DracoCompression : public Compression {
 protected:
  static constexpr std::uint32_t kUniqueId = 7;

  static GltfBuilder sheet(const DracoOptions& options = {}) {
    GltfBuilder builder;
    const int view = builder.add_view(draco_bytes(options, kUniqueId));
    builder.add("accessors",
                {{"componentType", test::kFloat}, {"count", kVertexCount}, {"type", "VEC3"}});
    builder.add(
        "accessors",
        {{"componentType", test::kUnsignedInt}, {"count", kIndexCount}, {"type", "SCALAR"}});
    builder.add_mesh({{"attributes", {{"POSITION", 0}}},
                      {"indices", 1},
                      {"extensions",
                       {{"KHR_draco_mesh_compression",
                         {{"bufferView", view}, {"attributes", {{"POSITION", kUniqueId}}}}}}}});
    builder.add_node({{"mesh", 0}});
    builder.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    return builder;
  }

  static json& extension(GltfBuilder& builder) {
    return builder.primitive()["extensions"]["KHR_draco_mesh_compression"];
  }

  // Gives the sheet's accessors uncompressed data, twice as large.
  static void add_fallback(GltfBuilder& builder) {
    std::vector<float> position = sheet_positions();
    for (float& value : position) value *= 2;
    builder.root["accessors"][0]["bufferView"] = builder.add_view(position);
    builder.root["accessors"][1]["bufferView"] = builder.add_view(sheet_indices());
    builder.root.erase("extensionsRequired");
  }
};

TEST_F(DracoCompression, IsDecodedByEitherMethod) {
  const auto expected = sorted_triangles(plain());
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    for (const bool with_metadata : {false, true}) {
      const Scene scene = import(sheet({method, false, with_metadata}));
      EXPECT_EQ(sorted_triangles(scene), expected);
      EXPECT_TRUE(scene.warnings.empty());
    }
  }
}

TEST_F(DracoCompression, QuantizationMovesVerticesALittle) {
  const auto expected = sorted_triangles(plain());
  const auto actual =
      sorted_triangles(import(sheet({draco::MESH_SEQUENTIAL_ENCODING, true, false})));
  ASSERT_EQ(actual.size(), expected.size());
  double worst = 0;
  for (std::size_t t = 0; t < actual.size(); ++t) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      worst = std::max<double>(worst, std::abs(actual[t][0][axis] - expected[t][0][axis]));
    }
  }
  EXPECT_LT(worst, 8.0 / (1 << 14));
}

TEST_F(DracoCompression, IsPreferredToItsFallback) {
  GltfBuilder builder = sheet();
  add_fallback(builder);
  const Scene scene = import(builder);
  EXPECT_EQ(sorted_triangles(scene), sorted_triangles(plain()));
  EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(DracoCompression, FallsBackWhereItCannotBeDecoded) {
  GltfBuilder builder = sheet();
  add_fallback(builder);
  extension(builder)["attributes"]["POSITION"] = 99;
  const Scene scene = import(builder);
  EXPECT_EQ(scene.triangle.size(), kIndexCount / 3);
  EXPECT_EQ(scene.position[scene.triangle[0][1]], (Float3{2, 0, 1.5F}));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("fallback"), std::string::npos);
}

TEST_F(DracoCompression, OfAnotherShapeThanItsAccessorsIsRefused) {
  GltfBuilder builder = sheet();
  builder.root["accessors"][1]["count"] = kIndexCount + 3;
  expect_refused(builder, "have 384 indices, but the accessor 387 elements");
  builder.root["accessors"][1]["count"] = kIndexCount - 3;
  expect_refused(builder, "claim 128 triangles where at most 127 are expected");
  builder = sheet();
  builder.root["accessors"][0]["type"] = "VEC2";
  expect_refused(builder, "has 3 components instead of 2");
  builder = sheet();
  extension(builder)["attributes"]["POSITION"] = 0;
  expect_refused(builder, "have no attribute 0");
  builder = sheet();
  builder.primitive()["mode"] = 5;
  expect_refused(builder, "only triangle lists");
}

/// Encoders split vertices at seams and leave the accessors as they were.
TEST_F(DracoCompression, MayHaveAnotherNumberOfVerticesThanItsAccessors) {
  GltfBuilder builder = sheet();
  builder.root["accessors"][0]["count"] = kVertexCount - 1;
  EXPECT_EQ(sorted_triangles(import(builder)), sorted_triangles(plain()));
  builder.primitive()["attributes"]["NORMAL"] =
      builder.add_accessor(std::vector<float>(3 * (kVertexCount - 1), 1), "VEC3", 3);
  expect_refused(builder, "NORMAL (accessors[2]) has 80 elements, but POSITION has 81");
}

TEST_F(DracoCompression, ValuesThatDoNotFitTheAccessorsTypeAreRefused) {
  GltfBuilder builder = sheet();
  builder.root["accessors"][0]["componentType"] = test::kUnsignedInt;
  expect_refused(builder, "component type 5125");
}

TEST_F(DracoCompression, PositionsAreCheckedAfterDecoding) {
  GltfBuilder builder = sheet({draco::MESH_SEQUENTIAL_ENCODING, false, false});
  const float infinity = std::numeric_limits<float>::infinity();
  const float last = sheet_positions().back();
  const auto place =
      builder.binary.rfind(std::string(reinterpret_cast<const char*>(&last), sizeof(last)));
  ASSERT_NE(place, std::string::npos);
  std::memcpy(builder.binary.data() + place, &infinity, sizeof(infinity));
  expect_refused(builder, "is not finite");
}

TEST_F(DracoCompression, WhatIsNotDracoIsRefused) {
  GltfBuilder builder = sheet();
  builder.binary[0] = 'X';
  expect_refused(builder, "not of Draco");
  builder = sheet();
  builder.binary[7] = 0;
  expect_refused(builder, "point cloud");
  builder = sheet();
  extension(builder)["bufferView"] = 5;
  expect_refused(builder, "KHR_draco_mesh_compression.bufferView is 5");
  extension(builder).erase("bufferView");
  expect_refused(builder, "KHR_draco_mesh_compression.bufferView is missing");
  builder = sheet();
  extension(builder).erase("attributes");
  expect_refused(builder, "KHR_draco_mesh_compression.attributes is missing");
}

TEST_F(DracoCompression, CutShortIsRefused) {
  const auto whole = static_cast<int>(draco_bytes({}, kUniqueId).size());
  for (const int length : {0, 4, 9, 12, 20, whole / 2, whole - 8}) {
    GltfBuilder builder = sheet();
    builder.root["bufferViews"][0]["byteLength"] = length;
    expect_refused(builder, "meshes[0]");
  }
}

TEST_F(DracoCompression, NoDamagedByteCrashes) {
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const GltfBuilder builder = sheet({method, true, true});
    damage_every_byte(builder);
  }
}

// ---- meshopt

class MeshoptCompression : public Compression, public ::testing::WithParamInterface<const char*> {
 protected:
  // A compressed view whose uncompressed bytes would lie in buffer 1.
  template <typename T>
  static int add_compressed(GltfBuilder& builder, const std::vector<unsigned char>& compressed,
                            const char* mode, const std::vector<T>& values, std::size_t stride) {
    const int raw = builder.add_view(compressed);
    const std::size_t bytes = values.size() * sizeof(T);
    json view = builder.root["bufferViews"].back();
    builder.root["bufferViews"].erase(static_cast<std::size_t>(raw));
    const json extension{{"buffer", 0},
                         {"byteOffset", view["byteOffset"]},
                         {"byteLength", view["byteLength"]},
                         {"byteStride", stride},
                         {"mode", mode},
                         {"count", bytes / stride}};
    return builder.add(
        "bufferViews",
        {{"buffer", 1}, {"byteLength", bytes}, {"extensions", {{GetParam(), extension}}}});
  }

  static std::vector<unsigned char> encoded_vertices(const void* vertices, std::size_t count,
                                                     std::size_t stride) {
    std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), vertices, count, stride));
    return bytes;
  }

  static std::vector<unsigned char> encoded_indices(const std::vector<std::uint32_t>& index,
                                                    bool as_triangles) {
    std::vector<unsigned char> bytes(
        as_triangles ? meshopt_encodeIndexBufferBound(index.size(), kVertexCount)
                     : meshopt_encodeIndexSequenceBound(index.size(), kVertexCount));
    bytes.resize(
        as_triangles
            ? meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), index.data(), index.size())
            : meshopt_encodeIndexSequence(bytes.data(), bytes.size(), index.data(), index.size()));
    return bytes;
  }

  static GltfBuilder sheet(bool as_triangles = true) {
    GltfBuilder builder;
    const auto position = sheet_positions();
    const auto index = sheet_indices();
    const int vertices = add_compressed(
        builder, encoded_vertices(position.data(), kVertexCount, 12), "ATTRIBUTES", position, 12);
    const int triangles = add_compressed(builder, encoded_indices(index, as_triangles),
                                         as_triangles ? "TRIANGLES" : "INDICES", index, 4);
    builder.add("accessors", {{"bufferView", vertices},
                              {"componentType", test::kFloat},
                              {"count", kVertexCount},
                              {"type", "VEC3"}});
    builder.add("accessors", {{"bufferView", triangles},
                              {"componentType", test::kUnsignedInt},
                              {"count", kIndexCount},
                              {"type", "SCALAR"}});
    builder.add_mesh({{"attributes", {{"POSITION", 0}}}, {"indices", 1}});
    builder.add_node({{"mesh", 0}});
    builder.root["extensionsRequired"] = {GetParam()};
    builder.root["buffers"] = {{{"byteLength", builder.binary.size()}},
                               {{"byteLength", 12 * kVertexCount + 4 * kIndexCount},
                                {"extensions", {{GetParam(), {{"fallback", true}}}}}}};
    return builder;
  }

  static json& extension(GltfBuilder& builder, std::size_t view) {
    return builder.root["bufferViews"][view]["extensions"][GetParam()];
  }

  // The sheet's first vertices replaced by what a filter makes of `values`, read as `accessor`.
  template <typename T>
  Scene import_filtered(const std::vector<T>& values, std::size_t stride, const char* filter,
                        json accessor) {
    GltfBuilder builder = sheet();
    const std::size_t count = values.size() * sizeof(T) / stride;
    const int view = add_compressed(builder, encoded_vertices(values.data(), count, stride),
                                    "ATTRIBUTES", values, stride);
    extension(builder, static_cast<std::size_t>(view))["filter"] = filter;
    builder.root["buffers"][0]["byteLength"] = builder.binary.size();
    builder.root["bufferViews"][static_cast<std::size_t>(view)]["byteStride"] = stride;
    accessor["bufferView"] = view;
    accessor["count"] = count;
    const int normals = builder.add("accessors", accessor);
    builder.primitive()["attributes"]["NORMAL"] = normals;
    return import(builder);
  }
};

TEST_P(MeshoptCompression, IsDecodedInEveryMode) {
  const Scene expected = plain();
  for (const bool as_triangles : {true, false}) {
    const Scene scene = import(sheet(as_triangles));
    EXPECT_EQ(sorted_triangles(scene), sorted_triangles(expected));
    EXPECT_TRUE(scene.warnings.empty());
  }
}

TEST_P(MeshoptCompression, OctahedralNormalsAreDecoded) {
  // The same tilted normal for all: (0.6, 0, 0.8), in 8 bits.
  std::vector<float> normal;
  for (std::size_t i = 0; i < kVertexCount; ++i) normal.insert(normal.end(), {0.6F, 0, 0.8F, 0});
  std::vector<std::int8_t> filtered(4 * kVertexCount);
  meshopt_encodeFilterOct(filtered.data(), kVertexCount, 4, 8, normal.data());
  const Scene scene =
      import_filtered(filtered, 4, "OCTAHEDRAL",
                      {{"componentType", test::kByte}, {"type", "VEC3"}, {"normalized", true}});
  for (const Float3& decoded : scene.normal) {
    EXPECT_NEAR(decoded[0], 0.6F, 0.02);
    EXPECT_NEAR(decoded[1], 0, 0.02);
    EXPECT_NEAR(decoded[2], 0.8F, 0.02);
  }
}

TEST_P(MeshoptCompression, ExponentialNormalsAreDecoded) {
  std::vector<float> normal;
  for (std::size_t i = 0; i < kVertexCount; ++i) normal.insert(normal.end(), {0.6F, 0, 0.8F});
  std::vector<std::uint32_t> filtered(3 * kVertexCount);
  meshopt_encodeFilterExp(filtered.data(), kVertexCount, 12, 20, normal.data());
  const Scene scene = import_filtered(filtered, 12, "EXPONENTIAL",
                                      {{"componentType", test::kFloat}, {"type", "VEC3"}});
  for (const Float3& decoded : scene.normal) {
    EXPECT_NEAR(decoded[0], 0.6F, 1e-5);
    EXPECT_NEAR(decoded[2], 0.8F, 1e-5);
  }
}

TEST_P(MeshoptCompression, QuaternionsOfInstancesAreDecoded) {
  const std::vector<float> turn{0, 0, 0.70710678F, 0.70710678F};  // a quarter, around z
  std::vector<std::int16_t> filtered(4);
  meshopt_encodeFilterQuat(filtered.data(), 1, 8, 12, turn.data());
  GltfBuilder builder = sheet();
  const int view =
      add_compressed(builder, encoded_vertices(filtered.data(), 1, 8), "ATTRIBUTES", filtered, 8);
  extension(builder, static_cast<std::size_t>(view))["filter"] = "QUATERNION";
  builder.root["buffers"][0]["byteLength"] = builder.binary.size();
  const int rotation = builder.add("accessors", {{"bufferView", view},
                                                 {"componentType", test::kShort},
                                                 {"normalized", true},
                                                 {"count", 1},
                                                 {"type", "VEC4"}});
  builder.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"ROTATION", rotation}};
  const Scene scene = import(builder);
  const Float3& along_x = scene.position[scene.triangle[0][1]];
  EXPECT_NEAR(along_x[0], 0, 2e-3);
  EXPECT_NEAR(along_x[1], 1, 2e-3);
}

TEST_P(MeshoptCompression, FallsBackWhereItCannotBeDecoded) {
  GltfBuilder builder = sheet();
  extension(builder, 0)["filter"] = "COLOR";
  expect_refused(builder, "bufferViews[0] (meshopt): its filter \"COLOR\" is not supported");
  const int fallback = builder.add_view(sheet_positions());
  builder.root["bufferViews"][0]["buffer"] = 0;
  builder.root["bufferViews"][0]["byteOffset"] =
      builder.root["bufferViews"][static_cast<std::size_t>(fallback)]["byteOffset"];
  builder.root["buffers"][0]["byteLength"] = builder.binary.size();
  const Scene scene = import(builder);
  EXPECT_EQ(sorted_triangles(scene), sorted_triangles(plain()));
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_NE(scene.warnings[0].find("fallback"), std::string::npos);
}

TEST_P(MeshoptCompression, FallbackBuffersMayBeMissing) {
  GltfBuilder builder = sheet();
  builder.root["buffers"][1]["uri"] = "absent.bin";
  EXPECT_EQ(import(builder).triangle.size(), kIndexCount / 3);
  builder.root["buffers"][1].erase("extensions");
  expect_refused(builder, "buffers[1]");
}

TEST_P(MeshoptCompression, NewerCodecsAreRefusedByName) {
  GltfBuilder builder = sheet();
  builder.binary[0] = static_cast<char>(0xA1);
  expect_refused(builder, "vertex codec is of version 1, which is not supported");
}

TEST_P(MeshoptCompression, LayoutsThatTheLibraryWouldTrustAreRefused) {
  const auto expect = [&](std::size_t view, const char* key, const json& value,
                          const std::string& named) {
    GltfBuilder builder = sheet();
    extension(builder, view)[key] = value;
    expect_refused(builder, named);
  };
  expect(0, "mode", "POINTS", "mode \"POINTS\" is unknown");
  expect(0, "mode", 3, "mode is not a string");
  expect(0, "byteStride", 6, "byteStride 6 does not go with");
  expect(0, "byteStride", 0, "byteStride 0 does not go with");
  expect(0, "byteStride", 260, "byteStride 260 does not go with");
  expect(1, "byteStride", 8, "byteStride 8 does not go with");
  expect(0, "filter", "OCTAHEDRAL", "byteStride 12 does not go with");
  expect(0, "filter", "QUATERNION", "byteStride 12 does not go with");
  expect(1, "filter", "EXPONENTIAL", "does not go with mode TRIANGLES");
  expect(1, "count", 4, "not of whole triangles");
  expect(0, "count", 1 << 30, "claim more than 64 times");
  expect(0, "byteLength", 1 << 20, "are not inside buffers[0]");
  expect(0, "byteOffset", 1 << 30, "are not inside buffers[0]");
  expect(0, "buffer", 9, ".buffer is 9");
  expect(0, "buffer", 1, "are not inside buffers[1]");
  expect(0, "byteLength", 20, "bufferViews[0]");
  expect(1, "byteLength", 30, "bufferViews[1]");
}

TEST_P(MeshoptCompression, FewerElementsThanTheAccessorsAreRefused) {
  GltfBuilder builder = sheet(false);
  extension(builder, 1)["count"] = kIndexCount - 3;
  expect_refused(builder, "bufferViews[1] (meshopt): its data are damaged");
  builder = sheet();
  builder.root["accessors"][0]["count"] = kVertexCount + 1;
  expect_refused(builder, "accessors[0]: 82 elements of 12 bytes");
}

TEST_P(MeshoptCompression, NoDamagedByteCrashes) {
  for (const bool as_triangles : {true, false}) {
    const GltfBuilder builder = sheet(as_triangles);
    damage_every_byte(builder);
  }
}

INSTANTIATE_TEST_SUITE_P(BothExtensions, MeshoptCompression,
                         ::testing::Values("EXT_meshopt_compression", "KHR_meshopt_compression"),
                         [](const auto& instance) {
                           return std::string(instance.param).substr(0, 3);
                         });

}  // namespace
}  // namespace rebounce::test_import_compression
