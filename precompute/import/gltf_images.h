#pragma once

#include <optional>

#include "precompute/import/gltf_container.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// A picture, and the bytes that stand for it in a Texture.
struct DecodedImage {
  Image image;                       ///< 8-bit RGBA, rows from the top
  std::vector<std::uint8_t> stored;  ///< `encoded` itself; a PNG of what was WebP
};

/// Decodes PNG, JPEG or WebP bytes. Empty where they cannot be decoded (animated WebP for one).
/// Throws Error where the picture would take more than 1 GiB.
std::optional<DecodedImage> decode_image(Bytes encoded);

}  // namespace rebounce::gltf
