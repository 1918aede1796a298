#include "runtime/demo/image/decoded_image.h"

#include <stb_image.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

constexpr int kMaxSide = 16384;  // texels; the largest texture takes 1 GiB when decoded

}  // namespace

DecodedImage decode_image(const Texture& texture) {
  const auto fail = [](const std::string& reason) -> Error {
    return Error("texture: " + reason + "; precompute the scene again from an intact file");
  };
  if (texture.encoded.size() > std::numeric_limits<int>::max()) throw fail("too many bytes");
  const auto* bytes = texture.encoded.data();
  const int byte_count = static_cast<int>(texture.encoded.size());
  DecodedImage base;
  int channel_count = 0;
  if (!stbi_info_from_memory(bytes, byte_count, &base.width, &base.height, &channel_count)) {
    throw fail("not a PNG or JPEG image");
  }
  if (base.width > kMaxSide || base.height > kMaxSide) throw fail("more than 16384 texels a side");
  const std::unique_ptr<stbi_uc, void (*)(void*)> texels(
      stbi_load_from_memory(bytes, byte_count, &base.width, &base.height, &channel_count, 4),
      stbi_image_free);
  if (!texels) throw fail("a damaged image");
  const std::size_t count = std::size_t{1} * base.width * base.height;
  base.rgb.reserve(3 * count);
  base.alpha.reserve(count);
  for (const stbi_uc* texel = texels.get(); texel != texels.get() + 4 * count; texel += 4) {
    base.rgb.insert(base.rgb.end(), texel, texel + 3);
    base.alpha.push_back(texel[3]);
  }
  if (std::ranges::all_of(base.alpha, [](std::uint8_t a) { return a == 255; })) base.alpha = {};
  return base;
}

}  // namespace rebounce
