#pragma once

// Small glTF files made by hand, for the importer's tests.

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace rebounce::test {

using nlohmann::json;

// componentType codes.
inline constexpr int kByte = 5120;
inline constexpr int kUnsignedByte = 5121;
inline constexpr int kShort = 5122;
inline constexpr int kUnsignedShort = 5123;
inline constexpr int kUnsignedInt = 5125;
inline constexpr int kFloat = 5126;

template <typename T>
constexpr int component_type() {
  if constexpr (std::is_same_v<T, std::int8_t>) return kByte;
  if constexpr (std::is_same_v<T, std::uint8_t>) return kUnsignedByte;
  if constexpr (std::is_same_v<T, std::int16_t>) return kShort;
  if constexpr (std::is_same_v<T, std::uint16_t>) return kUnsignedShort;
  if constexpr (std::is_same_v<T, std::uint32_t>) return kUnsignedInt;
  return kFloat;
}

/// An asset under construction. `root` is its JSON, free to be changed (or broken) by a test;
/// `binary` is its one buffer.
class GltfBuilder {
 public:
  GltfBuilder() { root["asset"]["version"] = "2.0"; }

  /// Adds `object` to the array `name` and returns its index.
  int add(const char* name, json object) {
    root[name].push_back(std::move(object));
    return static_cast<int>(root[name].size()) - 1;
  }

  template <typename T>
  int add_view(const std::vector<T>& values, int stride = 0) {
    while (binary.size() % 4 != 0) binary.push_back('\0');
    json view{
        {"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", values.size() * sizeof(T)}};
    if (stride != 0) view["byteStride"] = stride;
    binary.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    return add("bufferViews", view);
  }

  /// Adds an accessor of `type` ("SCALAR", "VEC2", ...) with `components` each.
  template <typename T>
  int add_accessor(const std::vector<T>& values, const char* type, std::size_t components,
                   bool normalized = false) {
    json accessor{{"bufferView", add_view(values)},
                  {"componentType", component_type<T>()},
                  {"count", values.size() / components},
                  {"type", type}};
    if (normalized) accessor["normalized"] = true;
    return add("accessors", accessor);
  }

  template <typename T>
  int add_indices(const std::vector<T>& values) {
    return add_accessor(values, "SCALAR", 1);
  }

  /// Adds a mesh of one primitive and returns its index.
  int add_mesh(json primitive) {
    return add("meshes", {{"name", "Mesh"}, {"primitives", json::array({std::move(primitive)})}});
  }

  /// Adds a node without a parent.
  int add_node(json node) { return add("nodes", std::move(node)); }

  /// A right triangle of area 1/2 in the plane z = 0, its front towards +z, as mesh 0 on node 0.
  static GltfBuilder triangle() {
    GltfBuilder builder;
    const int position = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    builder.add_mesh({{"attributes", {{"POSITION", position}}}});
    builder.add_node({{"mesh", 0}});
    return builder;
  }

  json& primitive() { return root["meshes"][0]["primitives"][0]; }

  /// The file as .glb.
  std::string glb() const {
    json complete = root;
    if (!complete.contains("buffers")) complete["buffers"] = {{{"byteLength", binary.size()}}};
    std::string text = complete.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string data = binary;
    data.resize((data.size() + 3) / 4 * 4, '\0');
    return "glTF" + u32(2) + u32(12 + 8 + text.size() + 8 + data.size()) + u32(text.size()) +
           "JSON" + text + u32(data.size()) + std::string("BIN\0", 4) + data;
  }

  std::filesystem::path write_glb(const TemporaryFolder& folder) const {
    auto path = folder.path() / "scene.glb";
    write_bytes(path, glb());
    return path;
  }

  /// The file as .gltf, its buffer beside it under `buffer_name`.
  std::filesystem::path write_gltf(const TemporaryFolder& folder,
                                   const std::string& buffer_name = "scene.bin") const {
    json complete = root;
    if (!complete.contains("buffers")) {
      complete["buffers"] = {{{"byteLength", binary.size()}, {"uri", buffer_name}}};
    }
    write_bytes(folder.path() / "scene.bin", binary);
    auto path = folder.path() / "scene.gltf";
    write_bytes(path, complete.dump());
    return path;
  }

  static std::string u32(std::size_t value) {
    std::string bytes(4, '\0');
    for (int i = 0; i < 4; ++i)
      bytes[static_cast<std::size_t>(i)] = static_cast<char>(value >> 8 * i);
    return bytes;
  }

  json root = json::object();
  std::string binary;
};

}  // namespace rebounce::test
