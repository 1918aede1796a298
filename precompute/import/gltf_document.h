#pragma once

#include <filesystem>

#include "precompute/import/gltf_asset.h"
#include "precompute/import/gltf_container.h"
#include "precompute/import/gltf_warnings.h"

namespace rebounce::gltf {

/// Reads a .glb or .gltf file, its buffers and its images. Throws Error (without the name of the
/// file) for a file that is damaged, hostile, or needs an unsupported feature; a missing image is
/// no error.
Document read_document(const std::filesystem::path& path, Warnings& warnings);

/// The bytes of a buffer view, decompressed. Throws Error if it does not lie inside its buffer.
Bytes view_bytes(const Document& document, int buffer_view);

}  // namespace rebounce::gltf
