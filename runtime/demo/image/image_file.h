#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "runtime/demo/image/images.h"

namespace rebounce {

/// Maps a picture to the screen: exposure, tone curve (tone_curve.h), sRGB encoding.
ScreenImage tone_map(const Picture& picture);

/// The image as a PNG file's bytes.
std::vector<std::uint8_t> encode_png(const ScreenImage& image);

/// Writes a PNG file completely or not at all (AtomicFile). Throws Error if the folder is missing,
/// not writable or full.
void write_png(const std::filesystem::path& path, const ScreenImage& image);

}  // namespace rebounce
