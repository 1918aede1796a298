#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "precompute/import/gltf_container.h"

namespace rebounce::gltf {

/// An image as the asset carries it.
struct EncodedImage {
  Bytes bytes;          ///< empty where it could not be had
  std::string problem;  ///< why, then
};

/// Where a primitive's compressed geometry lies (KHR_draco_mesh_compression).
struct DracoSource {
  int buffer_view = -1;
  std::map<std::string, std::uint32_t> unique_id;  ///< of the attributes in there, by name
  std::optional<std::size_t> index_count;  ///< of the primitive's index accessor, where it has one
  bool has_fallback = false;               ///< the asset holds the geometry uncompressed as well
};

/// A glTF asset with checked indices: its structure in tinygltf's types, its data as bytes.
struct Document {
  tinygltf::Model model;       ///< without buffers and images: those are below
  std::vector<Bytes> buffers;  ///< byteLength bytes each; empty where the asset has no data for it
  std::vector<Bytes> decoded_views;  ///< of the compressed buffer views, empty for the others
  std::vector<EncodedImage> images;
  std::map<std::pair<std::size_t, std::size_t>, DracoSource> draco;  ///< by mesh and primitive
  std::string hash;                                                  ///< as Scene::hash
  std::deque<std::vector<std::uint8_t>> storage;  ///< what the views above look into
};

}  // namespace rebounce::gltf
