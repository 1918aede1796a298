#include "precompute/import/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>

#include "precompute/import/gltf_meshopt.h"
#include "precompute/import/gltf_resources.h"
#include "precompute/import/gltf_validation.h"
#include "rebounce/error.h"
#include "transfer/file/content_hash.h"

namespace rebounce::gltf {
namespace {

using nlohmann::json;

// The objects of the array `key`; empty if there is no such array.
json& elements(json& parent, const char* key) {
  static json none = json::array();
  return parent.contains(key) ? parent[key] : none;
}

// Keeps the data of `uri` for the lifetime of the document.
Bytes store_resource(Document& document, ContentHash& hash, const std::filesystem::path& folder,
                     const std::string& uri) {
  Resource resource = read_resource(folder, uri);
  if (resource.external) hash.update(std::as_bytes(std::span(resource.bytes)));
  return document.storage.emplace_back(std::move(resource.bytes));
}

Bytes first_bytes(Bytes bytes, std::size_t length) {
  if (bytes.size() >= length) return bytes.first(length);
  throw Error(fmt::format("byteLength is {}, but only {} bytes are there; get a complete copy",
                          length, bytes.size()));
}

Bytes read_buffer(Document& document, ContentHash& hash, const json& buffer,
                  const std::filesystem::path& folder) {
  const auto length = buffer.at("byteLength").get<std::size_t>();
  const Bytes bytes =
      store_resource(document, hash, folder, buffer.at("uri").get_ref<const std::string&>());
  return first_bytes(bytes, length);
}

void read_buffers(Document& document, ContentHash& hash, const json& root,
                  const Container& container, const std::filesystem::path& folder) {
  if (!root.contains("buffers")) return;
  const json& buffers = root.at("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    Bytes bytes;
    try {
      if (buffers[i].contains("uri")) {
        bytes = read_buffer(document, hash, buffers[i], folder);
      } else if (i == 0 && container.binary) {
        bytes = first_bytes(*container.binary, buffers[i].at("byteLength").get<std::size_t>());
      }
    } catch (const Error& failure) {
      if (!is_meshopt_fallback(buffers[i])) {
        throw Error(fmt::format("buffers[{}]: {}", i, failure.what()));
      }
    }
    document.buffers.push_back(bytes);
  }
}

const json* draco_extension(const json& primitive) {
  const auto extensions = primitive.find("extensions");
  if (extensions == primitive.end() || !extensions->is_object()) return nullptr;
  const auto found = extensions->find("KHR_draco_mesh_compression");
  return found != extensions->end() && found->is_object() ? &*found : nullptr;
}

// The accessor that `holder` names as `key`; null if it names none.
const json* accessor_of(const json& root, const json& holder, const char* key) {
  const auto index = holder.find(key);
  if (index == holder.end()) return nullptr;
  return &root.at("accessors").at(index->get<std::size_t>());
}

bool lacks_data(const json* accessor) {
  return accessor && !accessor->contains("bufferView");
}

DracoSource draco_source(const json& root, const json& primitive, const json& extension) {
  DracoSource source;
  source.buffer_view = extension.at("bufferView").get<int>();
  source.unique_id = extension.at("attributes").get<std::map<std::string, std::uint32_t>>();
  const json* indices = accessor_of(root, primitive, "indices");
  if (indices) source.index_count = indices->at("count").get<std::size_t>();
  source.has_fallback = !lacks_data(indices) &&
                        !lacks_data(accessor_of(root, primitive.at("attributes"), "POSITION"));
  return source;
}

std::map<std::pair<std::size_t, std::size_t>, DracoSource> draco_sources(json& root) {
  std::map<std::pair<std::size_t, std::size_t>, DracoSource> sources;
  const json& meshes = elements(root, "meshes");
  for (std::size_t mesh = 0; mesh < meshes.size(); ++mesh) {
    const json primitives = meshes[mesh].value("primitives", json::array());
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const json* extension = draco_extension(primitives[i]);
      if (extension) sources[{mesh, i}] = draco_source(root, primitives[i], *extension);
    }
  }
  return sources;
}

// Counts what moves vertices, which a static scene does without.
void count_deformations(json& root, Warnings& warnings) {
  for (const json& node : elements(root, "nodes")) {
    if (node.contains("mesh") && node.contains("skin")) {
      warnings.count("{} skinned meshes stand as their nodes place them, without their skin");
    }
  }
  for (json& mesh : elements(root, "meshes")) {
    for (const json& primitive : elements(mesh, "primitives")) {
      if (primitive.contains("targets") && !primitive.at("targets").empty()) {
        warnings.count("{} primitives with morph targets are taken in their base shape");
      }
    }
  }
}

// What a static diffuse scene uses of a document, buffers and images apart, whose data are read
// before. All of it is checked.
constexpr std::array kStructure{"accessors",  "asset",     "bufferViews", "cameras",
                                "extensions", "materials", "meshes",      "nodes",
                                "samplers",   "scene",     "scenes",      "textures"};

void keep_structure(json& root) {
  for (auto member = root.begin(); member != root.end();) {
    const bool keeps = std::ranges::find(kStructure, member.key()) != kStructure.end();
    member = keeps ? std::next(member) : root.erase(member);
  }
}

void erase_all(json& object, std::initializer_list<const char*> keys) {
  for (const char* key : keys) object.erase(key);
}

// The JSON that tinygltf reads the structure from. It leaves out what is not used, and with it is
// not checked. It also leaves out the Draco extension, which is read separately: the decoder of
// tinygltf (in builds with it) would look for the data, and its check of indices refuses indices
// that are nowhere else.
std::string structure_text(json root) {
  keep_structure(root);
  for (json& material : elements(root, "materials")) {
    erase_all(material, {"normalTexture", "occlusionTexture", "extras"});
    if (material.contains("pbrMetallicRoughness")) {
      material["pbrMetallicRoughness"].erase("metallicRoughnessTexture");
    }
  }
  for (json& node : elements(root, "nodes")) erase_all(node, {"skin", "weights", "extras"});
  for (json& mesh : elements(root, "meshes")) {
    erase_all(mesh, {"weights", "extensions", "extras"});
    for (json& primitive : elements(mesh, "primitives")) {
      if (draco_extension(primitive) && lacks_data(accessor_of(root, primitive, "indices"))) {
        primitive.erase("indices");
      }
      erase_all(primitive, {"targets", "extensions", "extras"});
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
  // tinygltf reports some errors and continues without the object in question; indices would then
  // point at other objects.
  if (!loaded || !error.empty()) {
    throw Error(error.empty() ? "tinygltf could not read it" : error);
  }
  return model;
}

EncodedImage read_image(Document& document, ContentHash& hash, const json& image,
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

void read_images(Document& document, ContentHash& hash, const json& root,
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

Document read_document(const std::filesystem::path& path, Warnings& warnings) {
  const auto folder = std::filesystem::absolute(path).parent_path();
  Document document;
  const Bytes file = document.storage.emplace_back(read_file(path));
  ContentHash hash;
  hash.update(std::as_bytes(file));

  const Container container = split_container(file);
  json root = parse_json(container.json);
  check_version_and_extensions(root);
  check_structure(root);
  count_deformations(root, warnings);
  document.model = parse_structure(root);
  document.draco = draco_sources(root);
  read_buffers(document, hash, root, container, folder);
  decode_meshopt_views(root, document, warnings);
  read_images(document, hash, root, folder);
  document.hash = hash.text();
  return document;
}

Bytes view_bytes(const Document& document, int buffer_view) {
  const auto index = static_cast<std::size_t>(buffer_view);
  if (index < document.decoded_views.size() && !document.decoded_views[index].empty()) {
    return document.decoded_views[index];
  }
  const auto& view = document.model.bufferViews.at(index);
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
