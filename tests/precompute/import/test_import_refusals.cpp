// One hand-made file for each thing that the importer refuses. Every message is one line, has the
// file's name, and names the thing.

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "precompute/import/import_gltf.h"
#include "rebounce/error.h"
#include "tests/support/gltf_builder.h"

namespace rebounce::test_import_refusals {
namespace {

using test::GltfBuilder;
using test::json;

class ImportRefusals : public ::testing::Test {
 protected:
  void expect_refused_file(const std::filesystem::path& path,
                           const std::vector<std::string>& named) {
    try {
      import_gltf(path);
      ADD_FAILURE() << "was imported";
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(path.filename().string()), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      for (const std::string& name : named) {
        EXPECT_NE(message.find(name), std::string::npos) << message << "\n  lacks: " << name;
      }
    }
  }

  void expect_refused(const GltfBuilder& builder, const std::vector<std::string>& named) {
    expect_refused_file(builder.write_glb(folder_), named);
  }

  void expect_refused_bytes(const std::string& bytes, const std::vector<std::string>& named) {
    const auto path = folder_.path() / "scene.glb";
    test::write_bytes(path, bytes);
    expect_refused_file(path, named);
  }

  test::TemporaryFolder folder_;
  GltfBuilder triangle_ = GltfBuilder::triangle();
};

TEST_F(ImportRefusals, FileThatIsNotThere) {
  expect_refused_file(folder_.path() / "absent.glb", {"no such file"});
  expect_refused_file(folder_.path(), {"no such file"});
}

TEST_F(ImportRefusals, TruncatedGlb) {
  const std::string whole = triangle_.glb();
  for (const std::size_t length : {whole.size() - 1, whole.size() / 2, std::size_t{13}}) {
    expect_refused_bytes(whole.substr(0, length), {"truncated", "complete copy"});
  }
  expect_refused_bytes(whole.substr(0, 8), {"header", "complete copy"});
}

TEST_F(ImportRefusals, GlbOfAnotherVersionOrOrder) {
  std::string other = triangle_.glb();
  other[4] = 1;
  expect_refused_bytes(other, {"version 1"});
  std::string no_json = triangle_.glb();
  no_json[16] = 'X';
  expect_refused_bytes(no_json, {"first chunk"});
}

TEST_F(ImportRefusals, WhatIsNotJson) {
  expect_refused_bytes("", {"not glTF"});
  expect_refused_bytes("{\"asset\":\n{", {"truncated", "byte 11"});
  expect_refused_bytes("{\"asset\":\n?}", {"not JSON", "line 2"});
  expect_refused_bytes("solid cube", {"not glTF", "export"});
  expect_refused_bytes("[1, 2]", {"not glTF"});
  expect_refused_bytes("{}", {"asset.version"});
}

TEST_F(ImportRefusals, ATransferFile) {
  const std::string length("\x0e\0\0\0\0\0\0\0", 8);
  expect_refused_bytes(length + "{\"__metadata__\"", {"safetensors", "not a scene"});
}

TEST_F(ImportRefusals, JsonNestedWithoutEnd) {
  const std::string nested =
      "{\"asset\":{\"version\":\"2.0\",\"extras\":" + std::string(1000000, '[') +
      std::string(1000000, ']') + "}}";
  expect_refused_bytes(nested, {"nested"});
}

TEST_F(ImportRefusals, OtherVersionOfGltf) {
  triangle_.root["asset"]["version"] = "1.0";
  expect_refused(triangle_, {"glTF 1.0"});
  triangle_.root["asset"]["version"] = "two";
  expect_refused(triangle_, {"asset.version"});
  triangle_.root["asset"] = {{"version", "2.1"}, {"minVersion", "2.1"}};
  expect_refused(triangle_, {"2.1"});
}

TEST_F(ImportRefusals, RequiredExtensions) {
  triangle_.root["extensionsRequired"] = {"KHR_texture_transform", "ACME_anything"};
  expect_refused(triangle_, {"ACME_anything"});
  triangle_.root["extensionsRequired"] = "KHR_texture_transform";
  expect_refused(triangle_, {"extensionsRequired"});
}

TEST_F(ImportRefusals, CollectionsOfTheWrongType) {
  for (const char* name : {"buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes",
                           "materials", "textures", "images", "samplers", "cameras"}) {
    GltfBuilder builder = GltfBuilder::triangle();
    builder.root[name] = 3;
    expect_refused(builder, {name, "not an array"});
    builder.root[name] = json::array({"text"});
    expect_refused(builder, {name, "not an object"});
  }
}

TEST_F(ImportRefusals, IndicesOutOfRange) {
  const auto expect = [&](const json::json_pointer& pointer, const char* named) {
    for (const json& bad : {json(7), json(-1), json(0.5), json("0"), json(1e300)}) {
      GltfBuilder builder = GltfBuilder::triangle();
      builder.root[pointer] = bad;
      expect_refused(builder, {named});
    }
  };
  using namespace nlohmann::literals;
  expect("/accessors/0/bufferView"_json_pointer, "accessors[0].bufferView");
  expect("/bufferViews/0/buffer"_json_pointer, "bufferViews[0].buffer");
  expect("/meshes/0/primitives/0/indices"_json_pointer, "meshes[0].primitives[0].indices");
  expect("/meshes/0/primitives/0/material"_json_pointer, "meshes[0].primitives[0].material");
  expect("/meshes/0/primitives/0/attributes/POSITION"_json_pointer, "attributes.POSITION");
  expect("/nodes/0/mesh"_json_pointer, "nodes[0].mesh");
  expect("/nodes/0/camera"_json_pointer, "nodes[0].camera");
  expect("/scene"_json_pointer, "scene");
}

TEST_F(ImportRefusals, NodeReferencesOutOfRange) {
  triangle_.root["nodes"][0]["children"] = {0, 9};
  expect_refused(triangle_, {"nodes[0].children[1]", "9"});
  triangle_.root["nodes"][0].erase("children");
  triangle_.root["scenes"] = {{{"nodes", {4}}}};
  expect_refused(triangle_, {"scenes[0].nodes[0]", "4"});
  triangle_.root.erase("scenes");
  triangle_.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 2;
  expect_refused(triangle_, {"KHR_lights_punctual.light", "2"});
}

TEST_F(ImportRefusals, TextureReferencesOutOfRange) {
  triangle_.add("materials", {{"emissiveTexture", {{"index", 3}}}});
  expect_refused(triangle_, {"materials[0].emissiveTexture.index", "3"});
  triangle_.root["materials"][0] = {
      {"pbrMetallicRoughness", {{"baseColorTexture", {{"texCoord", 1}}}}}};
  expect_refused(triangle_, {"materials[0].pbrMetallicRoughness.baseColorTexture.index"});
  triangle_.root["materials"][0] = json::object();
  triangle_.add("textures", {{"source", 0}});
  expect_refused(triangle_, {"textures[0].source"});
}

TEST_F(ImportRefusals, CyclesAndNodesReachedTwice) {
  triangle_.root["nodes"] = {{{"children", {1}}}, {{"children", {2}}}, {{"children", {1}}}};
  triangle_.root["scenes"] = {{{"nodes", {0}}}};
  expect_refused(triangle_, {"nodes[1]", "cycle"});
  triangle_.root["scenes"] = {{{"nodes", {0, 0}}}};
  expect_refused(triangle_, {"nodes[0]", "twice"});
  triangle_.root["scenes"] = {{{"nodes", {0, 1}}}};
  expect_refused(triangle_, {"nodes[1]", "twice"});
}

TEST_F(ImportRefusals, HierarchyThatUnfoldsWithoutEnd) {
  // Every node names the next one twice: 2^60 placements from a kilobyte.
  json& nodes = triangle_.root["nodes"];
  nodes = json::array();
  for (int i = 0; i < 60; ++i) nodes.push_back({{"children", {i + 1, i + 1}}});
  nodes.push_back(json::object());
  expect_refused(triangle_, {"hierarchy", "nodes"});
}

TEST_F(ImportRefusals, TransformsOfTheWrongLength) {
  triangle_.root["nodes"][0]["matrix"] = json::array({1, 2, 3});
  expect_refused(triangle_, {"nodes[0].matrix", "16"});
  triangle_.root["nodes"][0] = {{"mesh", 0}, {"rotation", {0, 0, "1", 0}}};
  expect_refused(triangle_, {"nodes[0].rotation"});
}

TEST_F(ImportRefusals, TransformsThatOverflow) {
  triangle_.root["nodes"][0]["scale"] = {1e30, 1e30, 1e30};
  triangle_.add_node({{"children", {0}}, {"scale", {1e30, 1, 1}}});
  expect_refused(triangle_, {"meshes[0]", "vertex 1", "finite"});
}

TEST_F(ImportRefusals, BufferViewsAndAccessorsOutOfBounds) {
  using namespace nlohmann::literals;
  const auto expect = [&](const json::json_pointer& pointer, const json& value,
                          const std::vector<std::string>& named) {
    GltfBuilder builder = GltfBuilder::triangle();
    builder.root[pointer] = value;
    expect_refused(builder, named);
  };
  expect("/bufferViews/0/byteLength"_json_pointer, 4096, {"bufferViews[0]", "buffers[0]"});
  expect("/bufferViews/0/byteOffset"_json_pointer, 2147483647, {"bufferViews[0]"});
  expect("/bufferViews/0/byteOffset"_json_pointer, 4, {"bufferViews[0]"});
  expect("/bufferViews/0/byteStride"_json_pointer, 8, {"byteStride 8"});
  expect("/bufferViews/0/byteStride"_json_pointer, 7, {"byteStride"});
  expect("/accessors/0/count"_json_pointer, 4, {"accessors[0]", "bufferViews[0]"});
  expect("/accessors/0/count"_json_pointer, 2147483647, {"accessors[0]", "bufferViews[0]"});
  expect("/accessors/0/count"_json_pointer, 1ULL << 61, {"accessors[0].count"});
  expect("/accessors/0/byteOffset"_json_pointer, 4, {"accessors[0]"});
  expect("/accessors/0/byteOffset"_json_pointer, 2147483647, {"accessors[0]"});
  expect("/accessors/0/componentType"_json_pointer, 5130, {"accessor"});
  expect("/accessors/0/componentType"_json_pointer, 5125, {"accessors[0]", "32-bit"});
  expect("/accessors/0/componentType"_json_pointer, "float", {"accessors[0].componentType"});
  expect("/accessors/0/type"_json_pointer, "VEC9", {"VEC9"});
  expect("/accessors/0/type"_json_pointer, "VEC2", {"POSITION", "2 components"});
  expect("/accessors/0/type"_json_pointer, "MAT2", {"accessors[0]", "matrix"});
}

TEST_F(ImportRefusals, AccessorWithoutDataThatClaimsBillions) {
  triangle_.root["accessors"][0].erase("bufferView");
  triangle_.root["accessors"][0]["count"] = 2000000000;
  expect_refused(triangle_, {"accessors[0]", "2000000000"});
}

TEST_F(ImportRefusals, SparseAccessorsOutOfBounds) {
  const auto sparse = [](int count, std::uint16_t index) {
    GltfBuilder builder = GltfBuilder::triangle();
    const int indices = builder.add_view<std::uint16_t>({index});
    const int values = builder.add_view<float>({1, 2, 3});
    builder.root["accessors"][0]["sparse"] = {
        {"count", count},
        {"indices", {{"bufferView", indices}, {"componentType", test::kUnsignedShort}}},
        {"values", {{"bufferView", values}}}};
    return builder;
  };
  expect_refused(sparse(1, 3), {"accessors[0]", "sparse index 0 is 3"});
  expect_refused(sparse(2, 0), {"accessors[0]", "bufferViews[1]"});
  expect_refused(sparse(2147483647, 0), {"accessors[0]", "bufferViews[1]"});
  GltfBuilder missing = sparse(1, 0);
  missing.root["accessors"][0]["sparse"].erase("values");
  expect_refused(missing, {"accessors[0].sparse.values"});
}

TEST_F(ImportRefusals, VertexIndexOutOfRange) {
  triangle_.primitive()["indices"] = triangle_.add_indices<std::uint16_t>({0, 1, 3});
  expect_refused(triangle_, {"meshes[0] \"Mesh\"", "primitives[0]", "index 2 is 3", "3 vertices"});
}

TEST_F(ImportRefusals, IndicesThatAreNotUnsignedScalars) {
  triangle_.primitive()["indices"] = triangle_.add_indices<float>({0, 1, 2});
  expect_refused(triangle_, {"accessors[1]", "unsigned"});
}

TEST_F(ImportRefusals, PositionsThatAreNotFinite) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GltfBuilder builder = GltfBuilder::triangle();
    const int position = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, bad, 0}, "VEC3", 3);
    builder.primitive()["attributes"]["POSITION"] = position;
    expect_refused(builder, {"meshes[0] \"Mesh\"", "primitives[0]", "vertex 2"});
  }
}

TEST_F(ImportRefusals, AttributesOfDifferentLength) {
  triangle_.primitive()["attributes"]["NORMAL"] =
      triangle_.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC3", 3);
  expect_refused(triangle_, {"meshes[0]", "NORMAL", "2 elements", "3"});
}

TEST_F(ImportRefusals, ColoursThatAreNotNormalized) {
  triangle_.primitive()["attributes"]["COLOR_0"] =
      triangle_.add_accessor<std::uint8_t>(std::vector<std::uint8_t>(12, 255), "VEC4", 4);
  expect_refused(triangle_, {"COLOR_0", "normalized"});
}

TEST_F(ImportRefusals, UnknownPrimitiveMode) {
  triangle_.primitive()["mode"] = 9;
  expect_refused(triangle_, {"meshes[0]", "mode 9"});
}

TEST_F(ImportRefusals, SceneWithoutTriangles) {
  GltfBuilder empty;
  expect_refused(empty, {"no triangles"});
  triangle_.root["nodes"][0]["scale"] = {0, 0, 0};
  expect_refused(triangle_, {"no triangles", "area"});
}

TEST_F(ImportRefusals, MissingOrShortBuffer) {
  const auto path = triangle_.write_gltf(folder_);
  std::filesystem::remove(folder_.path() / "scene.bin");
  expect_refused_file(path, {"buffers[0]", "scene.bin"});
  test::write_bytes(folder_.path() / "scene.bin", "short");
  expect_refused_file(path, {"buffers[0]", "5 bytes"});
  triangle_.root["buffers"] = {{{"byteLength", triangle_.binary.size()}}};
  expect_refused_file(triangle_.write_gltf(folder_), {"buffers[0]"});
}

TEST_F(ImportRefusals, UrisThatLeaveTheFolder) {
  test::write_bytes(folder_.path() / "secret.bin", triangle_.binary);
  std::filesystem::create_directories(folder_.path() / "inner");
  for (const std::string& uri :
       {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"),
        std::string("a/../../secret.bin"), std::string("..\\secret.bin"),
        (folder_.path() / "secret.bin").string(), "file://" + folder_.path().string(),
        std::string("http://example.org/a.bin"), std::string("a%00b")}) {
    triangle_.root["buffers"] = {{{"byteLength", triangle_.binary.size()}, {"uri", uri}}};
    const auto path = folder_.path() / "inner" / "scene.gltf";
    test::write_bytes(path, triangle_.root.dump());
    expect_refused_file(path, {"buffers[0]", "refused"});
    triangle_.root["images"] = {{{"uri", uri}}};
    triangle_.root["buffers"] = {{{"byteLength", triangle_.binary.size()}}};
    expect_refused(triangle_, {"images[0]", "refused"});
    triangle_.root.erase("images");
  }
}

TEST_F(ImportRefusals, LinkThatLeavesTheFolder) {
  std::filesystem::create_directories(folder_.path() / "inner");
  test::write_bytes(folder_.path() / "secret.bin", triangle_.binary);
  std::filesystem::create_symlink(folder_.path() / "secret.bin", folder_.path() / "inner/link.bin");
  triangle_.root["buffers"] = {{{"byteLength", triangle_.binary.size()}, {"uri", "link.bin"}}};
  const auto path = folder_.path() / "inner" / "scene.gltf";
  test::write_bytes(path, triangle_.root.dump());
  expect_refused_file(path, {"buffers[0]", "refused"});
}

TEST_F(ImportRefusals, DamagedDataUri) {
  for (const char* uri : {"data:application/octet-stream;base64,", "data:,plain", "data:"}) {
    triangle_.root["buffers"] = {{{"byteLength", 36}, {"uri", uri}}};
    expect_refused(triangle_, {"buffers[0]", "data URI"});
  }
}

TEST_F(ImportRefusals, HugeImage) {
  // A PNG header that claims 20,000 x 20,000 pixels; nothing after it.
  std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x4e\x20\0\0\x4e\x20\x08\x06\0\0\0\0\0\0\0",
                  33);
  png += std::string("\0\0\0\0IDAT\0\0\0\0", 12);
  const int view = triangle_.add_view(std::vector<char>(png.begin(), png.end()));
  triangle_.add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
  triangle_.add("textures", {{"source", 0}});
  triangle_.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  triangle_.primitive()["material"] = 0;
  expect_refused(triangle_, {"images[0]", "20000 x 20000"});
}

TEST_F(ImportRefusals, MaterialFactorsOfTheWrongKind) {
  triangle_.add("materials", {{"emissiveFactor", {1, 2}}});
  expect_refused(triangle_, {"materials[0].emissiveFactor"});
  triangle_.root["materials"][0] = {
      {"name", "Lamp"},
      {"emissiveFactor", {1, 1, 1}},
      {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 1e200}}}}}};
  expect_refused(triangle_, {"materials[0] \"Lamp\"", "finite"});
  json& extensions = triangle_.root["materials"][0]["extensions"];
  extensions["KHR_materials_emissive_strength"]["emissiveStrength"] = 2e38;
  expect_refused(triangle_, {"materials[0] \"Lamp\"", "1e30", "emissiveStrength"});
}

/// Every byte of a small asset set to something else: imported or refused, never more.
TEST_F(ImportRefusals, NoDamagedByteCrashes) {
  GltfBuilder builder = GltfBuilder::triangle();
  builder.primitive()["indices"] = builder.add_indices<std::uint8_t>({0, 1, 2});
  const std::string whole = builder.glb();
  const auto path = folder_.path() / "scene.glb";
  int refused = 0;
  int imported = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const char replacement : {'\0', '9', '"', '\xFF'}) {
      std::string damaged = whole;
      damaged[i] = replacement;
      test::write_bytes(path, damaged);
      try {
        import_gltf(path);
        ++imported;
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(imported, 100);
}

}  // namespace
}  // namespace rebounce::test_import_refusals
