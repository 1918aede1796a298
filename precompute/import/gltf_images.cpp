#include "precompute/import/gltf_images.h"

#include <fmt/format.h>
#include <stb_image.h>
#include <stb_image_write.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <new>

#include "rebounce/error.h"

namespace rebounce::gltf {
namespace {

constexpr std::uint64_t kMaxDecodedBytes = std::uint64_t{1} << 30;

template <std::size_t N>
bool starts_with(Bytes encoded, const std::array<std::uint8_t, N>& magic) {
  return encoded.size() >= N && std::equal(magic.begin(), magic.end(), encoded.begin());
}

std::uint64_t big_endian_u32(Bytes bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | bytes[offset + i];
  return value;
}

bool is_webp(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kRiff{'R', 'I', 'F', 'F'};
  constexpr std::array<std::uint8_t, 4> kWebp{'W', 'E', 'B', 'P'};
  constexpr std::size_t kFormOffset = 8;
  return encoded.size() > kFormOffset && starts_with(encoded, kRiff) &&
         starts_with(encoded.subspan(kFormOffset), kWebp);
}

// Width and height; empty for data that is not PNG, JPEG or WebP. glTF and its extension allow only
// these; stb would accept many more formats, each with its own ways of being damaged.
std::optional<std::array<std::uint64_t, 2>> pixel_size(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
  constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};
  constexpr std::size_t kPngWidth = 16;  // the header chunk comes first
  if (starts_with(encoded, kPng) && encoded.size() >= kPngWidth + 8) {
    return {{big_endian_u32(encoded, kPngWidth), big_endian_u32(encoded, kPngWidth + 4)}};
  }
  int width = 0;
  int height = 0;
  int channels = 0;
  if (is_webp(encoded)) {
    if (!WebPGetInfo(encoded.data(), encoded.size(), &width, &height)) return {};
  } else if (!starts_with(encoded, kJpeg) ||
             !stbi_info_from_memory(encoded.data(), static_cast<int>(encoded.size()), &width,
                                    &height, &channels)) {
    return {};
  }
  return {{static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)}};
}

struct Deleter {
  void operator()(std::uint8_t* bytes) const { release(bytes); }
  void (*release)(void*);
};
using Pixels = std::unique_ptr<std::uint8_t[], Deleter>;

std::optional<Image> decode_pixels(Bytes encoded) {
  int width = 0;
  int height = 0;
  int channels = 0;
  const Pixels pixels =
      is_webp(encoded)
          ? Pixels(WebPDecodeRGBA(encoded.data(), encoded.size(), &width, &height), {WebPFree})
          : Pixels(stbi_load_from_memory(encoded.data(), static_cast<int>(encoded.size()), &width,
                                         &height, &channels, 4),
                   {stbi_image_free});
  if (!pixels || width <= 0 || height <= 0) return {};
  const std::size_t bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4;
  return Image{width, height, {pixels.get(), pixels.get() + bytes}};
}

std::vector<std::uint8_t> encode_png(const Image& image) {
  std::vector<std::uint8_t> bytes;
  const auto append = [](void* target, void* data, int size) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    static_cast<std::vector<std::uint8_t>*>(target)->assign(first, first + size);
  };
  if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, 4, image.rgba.data(),
                              4 * image.width)) {
    throw std::bad_alloc();
  }
  return bytes;
}

}  // namespace

std::optional<DecodedImage> decode_image(Bytes encoded) {
  if (encoded.size() > std::numeric_limits<int>::max()) return {};
  const auto size = pixel_size(encoded);
  if (!size) return {};
  const auto [columns, rows] = *size;
  if (rows != 0 && columns > kMaxDecodedBytes / 4 / rows) {
    throw Error(fmt::format(
        "an image of {} x {} pixels is too large (at most 1 GiB); scale it down", columns, rows));
  }
  std::optional<Image> image = decode_pixels(encoded);
  if (!image) return {};
  auto stored = is_webp(encoded) ? encode_png(*image)
                                 : std::vector<std::uint8_t>(encoded.begin(), encoded.end());
  return DecodedImage{std::move(*image), std::move(stored)};
}

}  // namespace rebounce::gltf
