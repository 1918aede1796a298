#include "precompute/import/gltf_images.h"

#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <memory>

#include "runtime/images/coded_image.h"

namespace rebounce::gltf {
namespace {

template <std::size_t N>
bool starts_with(Bytes encoded, const std::array<std::uint8_t, N>& magic) {
  return encoded.size() >= N && std::equal(magic.begin(), magic.end(), encoded.begin());
}

bool is_webp(Bytes encoded) {
  constexpr std::array<std::uint8_t, 4> kRiff{'R', 'I', 'F', 'F'};
  constexpr std::array<std::uint8_t, 4> kWebp{'W', 'E', 'B', 'P'};
  constexpr std::size_t kFormOffset = 8;
  return encoded.size() > kFormOffset && starts_with(encoded, kRiff) &&
         starts_with(encoded.subspan(kFormOffset), kWebp);
}

std::optional<RgbaImage> decode_webp(Bytes encoded) {
  int width = 0, height = 0;
  if (!WebPGetInfo(encoded.data(), encoded.size(), &width, &height)) return {};
  refuse_large_image(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height));
  const auto end = [](std::uint8_t* pixels) { WebPFree(pixels); };
  const std::unique_ptr<std::uint8_t, decltype(end)> pixels(
      WebPDecodeRGBA(encoded.data(), encoded.size(), &width, &height), end);
  if (!pixels) return {};
  const std::size_t bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4;
  return RgbaImage{width, height, {pixels.get(), pixels.get() + bytes}};
}

}  // namespace

std::optional<DecodedImage> decode_image(Bytes encoded) {
  if (!is_webp(encoded)) {
    auto image = decode_png_or_jpeg(encoded);
    if (!image) return {};
    return DecodedImage{std::move(*image), {encoded.begin(), encoded.end()}};
  }
  auto image = decode_webp(encoded);
  if (!image) return {};
  auto stored = encode_png(image->width, image->height, 4, image->rgba);
  return DecodedImage{std::move(*image), std::move(stored)};
}

}  // namespace rebounce::gltf
