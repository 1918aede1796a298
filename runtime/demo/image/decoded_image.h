#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/scene_data.h"

namespace rebounce {

/// A texture's texels: 8-bit sRGB, rows from the top.
struct DecodedImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb{};    ///< [height][width][3]
  std::vector<std::uint8_t> alpha{};  ///< [height][width], or empty: opaque
};

/// Throws Error if the image cannot be decoded or is too large.
DecodedImage decode_image(const Texture& texture);

}  // namespace rebounce
