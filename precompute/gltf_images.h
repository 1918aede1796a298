#pragma once

#include <optional>

#include "gltf_container.h"
#include "rebounce/precompute/scene.h"

namespace rebounce::gltf {

/// Decodes PNG or JPEG bytes to 8-bit RGBA, rows from the top. Empty where they cannot be decoded.
/// Throws Error where the picture would take more than 1 GiB.
std::optional<Image> decode_image(Bytes encoded);

}  // namespace rebounce::gltf
