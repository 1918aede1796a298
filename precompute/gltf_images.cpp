#include "gltf_images.h"

#include <fmt/format.h>
#include <stb_image.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "rebounce/transfer/error.h"

namespace rebounce::gltf {
namespace {

constexpr std::uint64_t kMaxDecodedBytes = std::uint64_t{1} << 30;

// glTF allows these two; stb would take many more formats, each with its own way to be damaged.
bool is_png_or_jpeg(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  const auto starts_with = [&](const auto& magic) {
    return encoded.size() > magic.size() && std::equal(magic.begin(), magic.end(), encoded.begin());
  };
  return starts_with(kPng) || starts_with(kJpeg);
}

}  // namespace

std::optional<Image> decode_image(Bytes encoded) {
  if (!is_png_or_jpeg(encoded) || encoded.size() > std::numeric_limits<int>::max()) return {};
  const int size = static_cast<int>(encoded.size());
  int width = 0;
  int height = 0;
  int channels = 0;
  if (!stbi_info_from_memory(encoded.data(), size, &width, &height, &channels)) return {};
  const auto bytes = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * 4;
  if (bytes > kMaxDecodedBytes) {
    throw Error(fmt::format(
        "an image of {} x {} pixels is too large (at most 1 GiB); scale it down", width, height));
  }
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(encoded.data(), size, &width, &height, &channels, 4), stbi_image_free);
  if (!pixels || width <= 0 || height <= 0) return {};
  return Image{width, height, {pixels.get(), pixels.get() + bytes}};
}

}  // namespace rebounce::gltf
