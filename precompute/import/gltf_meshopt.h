#pragma once

#include <nlohmann/json_fwd.hpp>

#include "precompute/import/gltf_asset.h"
#include "precompute/import/gltf_warnings.h"

namespace rebounce::gltf {

/// Whether a buffer only stands in for readers without EXT_meshopt_compression or
/// KHR_meshopt_compression: it may lack its data.
bool is_meshopt_fallback(const nlohmann::json& buffer);

/// Decodes the buffer views of `root` (checked) that one of these extensions compresses, into
/// `document.decoded_views`; its buffers were read. Where a view cannot be decoded and its buffer
/// holds it uncompressed too, that is taken and counted. Throws Error, which names the view, where
/// it does not, and where the views claim more than their bytes can expand to.
void decode_meshopt_views(const nlohmann::json& root, Document& document, Warnings& warnings);

}  // namespace rebounce::gltf
