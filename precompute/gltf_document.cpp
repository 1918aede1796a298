#include "gltf_document.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "gltf_resources.h"
#include "gltf_validation.h"
#include "rebounce/transfer/error.h"

namespace rebounce::gltf {
namespace {

using nlohmann::json;

class Hash {
 public:
  Hash() : state_(XXH3_createState(), XXH3_freeState) {
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_.get());
  }

  void add(Bytes bytes) { XXH3_128bits_update(state_.get(), bytes.data(), bytes.size()); }

  std::string text() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    return fmt::format("xxh3:{:016x}{:016x}", hash.high64, hash.low64);
  }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

// The objects of the array `key`, none where there is no such array.
json& elements(json& parent, const char* key) {
  static json none = json::array();
  return parent.contains(key) ? parent[key] : none;
}

// Keeps what `uri` names for as long as the document lives.
Bytes store_resource(Document& document, Hash& hash, const std::filesystem::path& folder,
                     const std::string& uri) {
  Resource resource = read_resource(folder, uri);
  if (resource.external) hash.add(resource.bytes);
  return document.storage.emplace_back(std::move(resource.bytes));
}

void read_buffers(Document& document, Hash& hash, const json& root, const Container& container,
                  const std::filesystem::path& folder) {
  if (!root.contains("buffers")) return;
  const json& buffers = root.at("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const auto length = buffers[i].at("byteLength").get<std::size_t>();
    Bytes bytes;
    if (buffers[i].contains("uri")) {
      try {
        bytes = store_resource(document, hash, folder,
                               buffers[i].at("uri").get_ref<const std::string&>());
      } catch (const Error& failure) {
        throw Error(fmt::format("buffers[{}]: {}", i, failure.what()));
      }
    } else if (i == 0 && container.binary) {
      bytes = *container.binary;
    } else {
      document.buffers.emplace_back();
      continue;
    }
    if (bytes.size() < length) {
      throw Error(
          fmt::format("buffers[{}]: byteLength is {}, but only {} bytes are there; get a complete "
                      "copy",
                      i, length, bytes.size()));
    }
    document.buffers.push_back(bytes.first(length));
  }
}

// What the asset's structure is read from: without the data, which was read above, without what a
// static diffuse scene has no use for, and without Draco's extension, whose decoder (where tinygltf
// was built with it) would look for the data.
std::string structure_text(json root) {
  for (const char* key : {"buffers", "images", "animations", "skins", "extras"}) root.erase(key);
  for (json& material : elements(root, "materials")) {
    material.erase("normalTexture");
    material.erase("occlusionTexture");
    if (material.contains("pbrMetallicRoughness")) {
      material["pbrMetallicRoughness"].erase("metallicRoughnessTexture");
    }
  }
  for (json& mesh : elements(root, "meshes")) {
    for (json& primitive : elements(mesh, "primitives")) {
      primitive.erase("extensions");
    }
  }
  return root.dump();
}

tinygltf::Model parse_structure(const json& root) {
  const std::string text = structure_text(root);
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error;
  std::string warning;
  const bool loaded = loader.LoadASCIIFromString(&model, &error, &warning, text.data(),
                                                 static_cast<unsigned>(text.size()), "");
  // tinygltf reports some faults and goes on without the object that has them: indices would
  // then point at something else.
  if (!loaded || !error.empty()) {
    throw Error(error.empty() ? "tinygltf could not read it" : error);
  }
  return model;
}

EncodedImage read_image(Document& document, Hash& hash, const json& image,
                        const std::filesystem::path& folder) {
  if (image.contains("bufferView")) {
    return {view_bytes(document, image.at("bufferView").get<int>()), ""};
  }
  if (!image.contains("uri")) return {{}, "it has neither a URI nor a buffer view"};
  const std::string& uri = image.at("uri").get_ref<const std::string&>();
  check_uri(folder, uri);
  try {
    return {store_resource(document, hash, folder, uri), ""};
  } catch (const Error& failure) {
    return {{}, failure.what()};
  }
}

void read_images(Document& document, Hash& hash, const json& root,
                 const std::filesystem::path& folder) {
  if (!root.contains("images")) return;
  const json& images = root.at("images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    try {
      document.images.push_back(read_image(document, hash, images[i], folder));
    } catch (const Error& failure) {
      throw Error(fmt::format("images[{}]: {}", i, failure.what()));
    }
  }
}

}  // namespace

Document read_document(const std::filesystem::path& path) {
  const auto folder = std::filesystem::absolute(path).parent_path();
  Document document;
  const Bytes file = document.storage.emplace_back(read_file(path));
  Hash hash;
  hash.add(file);

  const Container container = split_container(file);
  json root = parse_json(container.json);
  check_version_and_extensions(root);
  check_structure(root);
  document.model = parse_structure(root);
  read_buffers(document, hash, root, container, folder);
  read_images(document, hash, root, folder);
  document.hash = hash.text();
  return document;
}

Bytes view_bytes(const Document& document, int buffer_view) {
  const auto& view = document.model.bufferViews.at(static_cast<std::size_t>(buffer_view));
  const Bytes buffer = document.buffers.at(static_cast<std::size_t>(view.buffer));
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
    throw Error(
        fmt::format("bufferViews[{}] (bytes {} to {}) is not inside buffers[{}], which has {} "
                    "bytes",
                    buffer_view, view.byteOffset, view.byteOffset + view.byteLength, view.buffer,
                    buffer.size()));
  }
  return buffer.subspan(view.byteOffset, view.byteLength);
}

}  // namespace rebounce::gltf
