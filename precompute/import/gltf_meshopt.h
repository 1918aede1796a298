#pragma once

#include <nlohmann/json_fwd.hpp>

#include "precompute/import/gltf_asset.h"
#include "precompute/import/gltf_warnings.h"

namespace rebounce::gltf {

/// True if a buffer is only a fallback for readers without EXT_meshopt_compression or
/// KHR_meshopt_compression. It may have no data.
bool is_meshopt_fallback(const nlohmann::json& buffer);

/// Decodes the buffer views of `root` (checked) that one of these extensions compresses into
/// `document.decoded_views`. The buffers must be read before. If a view cannot be decoded and its
/// buffer also holds it uncompressed, that data is used and counted; otherwise throws Error, which
/// names the view. Also throws if the views declare more than their bytes can expand to.
void decode_meshopt_views(const nlohmann::json& root, Document& document, Warnings& warnings);

}  // namespace rebounce::gltf
