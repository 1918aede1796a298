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

struct PixelSize {
  std::uint64_t columns = 0, rows = 0;
  std::uint64_t least_bytes = 0;  ///< that the format can hold so many pixels in
};

constexpr std::array<std::uint8_t, 4> kPng{0x89, 'P', 'N', 'G'};
constexpr std::array<std::uint8_t, 3> kJpeg{0xFF, 0xD8, 0xFF};

// What the first chunk of a PNG says; empty if it is not a header. stb takes other chunks before
// it, and makes room for all pixels before it looks at their data.
std::optional<PixelSize> png_size(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kHeaderChunk{'I', 'H', 'D', 'R'};
  constexpr std::size_t kType = 12, kWidth = 16, kHeight = 20, kDepth = 24, kColour = 25;
  constexpr std::array<std::uint64_t, 7> kChannels{1, 0, 3, 1, 2, 0, 4};  // by colour type
  constexpr std::uint64_t kMaxDeflation = 1032;                           // of the format
  constexpr std::uint64_t kMaxSide = std::uint64_t{1} << 24;              // of stb
  if (encoded.size() <= kColour || !starts_with(encoded.subspan(kType), kHeaderChunk)) return {};
  PixelSize size{big_endian_u32(encoded, kWidth), big_endian_u32(encoded, kHeight)};
  const std::uint8_t colour = encoded[kColour];
  if (colour >= kChannels.size()) return {};
  if (size.columns > kMaxSide || size.rows > kMaxSide) return size;
  const std::uint64_t row = size.columns * encoded[kDepth] * kChannels[colour] / 8 + 1;
  size.least_bytes = size.rows * row / kMaxDeflation;
  return size;
}

std::optional<PixelSize> jpeg_size(Bytes encoded) {
  constexpr std::uint64_t kMaxPixelsPerByte = 512;  // a bit for a block of 8 x 8
  int width = 0, height = 0, channels = 0;
  if (!stbi_info_from_memory(encoded.data(), static_cast<int>(encoded.size()), &width, &height,
                             &channels)) {
    return {};
  }
  PixelSize size{static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)};
  size.least_bytes = size.columns * size.rows / kMaxPixelsPerByte;
  return size;
}

std::optional<PixelSize> webp_size(Bytes encoded) {
  int width = 0, height = 0;
  if (!WebPGetInfo(encoded.data(), encoded.size(), &width, &height)) return {};
  return PixelSize{static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)};
}

// Empty for data that is not PNG, JPEG or WebP. glTF and its extension allow only these; stb would
// accept many more formats, each with its own ways of being damaged.
std::optional<PixelSize> pixel_size(Bytes encoded) {
  if (starts_with(encoded, kPng)) return png_size(encoded);
  if (starts_with(encoded, kJpeg)) return jpeg_size(encoded);
  return is_webp(encoded) ? webp_size(encoded) : std::nullopt;
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
  const auto [columns, rows, least_bytes] = *size;
  if (rows != 0 && columns > kMaxDecodedBytes / 4 / rows) {
    throw Error(fmt::format(
        "an image of {} x {} pixels is too large (at most 1 GiB); scale it down", columns, rows));
  }
  if (encoded.size() < least_bytes) return {};
  std::optional<Image> image = decode_pixels(encoded);
  if (!image) return {};
  auto stored = is_webp(encoded) ? encode_png(*image)
                                 : std::vector<std::uint8_t>(encoded.begin(), encoded.end());
  return DecodedImage{std::move(*image), std::move(stored)};
}

}  // namespace rebounce::gltf
