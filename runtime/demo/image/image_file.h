#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "runtime/demo/picture/picture.h"

namespace rebounce {

/// 8-bit sRGB, rows from the top.
struct ScreenImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb{};  ///< [height][width][3]
};

/// Brings a picture to the screen's range: exposure, tone curve (tone_curve.h), sRGB encoding.
ScreenImage tone_map(const Picture& picture);

/// The image as a PNG file's bytes.
std::vector<std::uint8_t> encode_png(const ScreenImage& image);

/// Writes a PNG file whole or not at all (see AtomicFile). Throws Error if the folder is missing,
/// not writable or full.
void write_png(const std::filesystem::path& path, const ScreenImage& image);

}  // namespace rebounce
