#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace rebounce {

/// 8-bit RGBA, rows from the top.
struct RgbaImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba{};  ///< [height][width][4]
};

/// Decodes a PNG or a JPEG. Colour profiles and gamma in it are ignored (glTF 2.0, section 3.8.4).
/// Empty if it is neither, or damaged. Throws Error if it would take more than 1 GiB.
std::optional<RgbaImage> decode_png_or_jpeg(std::span<const std::uint8_t> encoded);

/// `pixels` [height][width][channels] as a PNG file's bytes; 3 channels are RGB, 4 are RGBA. Throws
/// Error if the size is none that a PNG has.
std::vector<std::uint8_t> encode_png(int width, int height, int channels,
                                     std::span<const std::uint8_t> pixels);

/// Throws Error if columns * rows pixels in RGBA take more than 1 GiB.
void refuse_large_image(std::uint64_t columns, std::uint64_t rows);

}  // namespace rebounce
