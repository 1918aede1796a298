#pragma once

#include <tiny_gltf.h>

#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include "gltf_container.h"
#include "gltf_warnings.h"

namespace rebounce::gltf {

/// An image as the asset carries it.
struct EncodedImage {
  Bytes bytes;          ///< empty where it could not be had
  std::string problem;  ///< why, then
};

/// A glTF asset with checked indices: its structure in tinygltf's types, its data as bytes.
struct Document {
  tinygltf::Model model;       ///< without buffers and images: those are below
  std::vector<Bytes> buffers;  ///< byteLength bytes each; empty where the asset has no data for it
  std::vector<EncodedImage> images;
  std::string hash;                               ///< as Scene::hash
  std::deque<std::vector<std::uint8_t>> storage;  ///< what the views above look into
};

/// Reads a .glb or .gltf file, its buffers and its images. Throws Error (without the file's name)
/// for a file that is damaged, hostile, or needs something unsupported; an image that is missing is
/// no error.
Document read_document(const std::filesystem::path& path);

/// The bytes of a buffer view. Throws Error where it does not lie inside its buffer.
Bytes view_bytes(const Document& document, int buffer_view);

}  // namespace rebounce::gltf
