#pragma once

#include <optional>

#include "precompute/import/gltf_container.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// A decoded image, and the bytes that represent it in a Texture.
struct DecodedImage {
  Image image;                       ///< 8-bit RGBA, rows from the top
  std::vector<std::uint8_t> stored;  ///< `encoded` itself; for WebP a PNG
};

/// Decodes PNG, JPEG or WebP bytes. Empty if they cannot be decoded (for example animated WebP).
/// Throws Error if the image would take more than 1 GiB.
std::optional<DecodedImage> decode_image(Bytes encoded);

}  // namespace rebounce::gltf
