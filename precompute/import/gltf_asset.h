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

/// An image as the asset stores it.
struct EncodedImage {
  Bytes bytes;          ///< empty if it could not be read
  std::string problem;  ///< the reason, in that case
};

/// The compressed geometry of a primitive (KHR_draco_mesh_compression).
struct DracoSource {
  int buffer_view = -1;
  std::map<std::string, std::uint32_t> unique_id;  ///< of its attributes, by name
  /// Of the index accessor of the primitive, if it has one.
  std::optional<std::size_t> index_count;
  bool has_fallback = false;  ///< the asset also holds the geometry uncompressed
};

/// A glTF asset with checked indices: its structure in the types of tinygltf, its data as bytes.
struct Document {
  tinygltf::Model model;       ///< without buffers and images, which are below
  std::vector<Bytes> buffers;  ///< byteLength bytes each; empty if the asset has no data for it
  std::vector<Bytes> decoded_views;  ///< of the compressed buffer views, empty for others
  std::vector<EncodedImage> images;
  std::map<std::pair<std::size_t, std::size_t>, DracoSource> draco;  ///< by mesh and primitive
  std::string hash;                                                  ///< as Scene::hash
  std::deque<std::vector<std::uint8_t>> storage;                     ///< memory of the views above
};

}  // namespace rebounce::gltf
