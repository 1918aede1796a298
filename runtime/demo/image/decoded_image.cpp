#include "runtime/demo/image/decoded_image.h"

#include <algorithm>
#include <string>

#include "rebounce/error.h"
#include "runtime/images/coded_image.h"

namespace rebounce {
namespace {

constexpr int kMaxSide = 16384;  // texels; the largest texture takes 1 GiB when decoded

}  // namespace

DecodedImage decode_image(const Texture& texture) {
  const auto fail = [](const std::string& reason) -> Error {
    return Error("texture: " + reason + "; precompute the scene again from an intact file");
  };
  const auto image = decode_png_or_jpeg(texture.encoded);
  if (!image) throw fail("not a PNG or JPEG image, or a damaged one");
  if (image->width > kMaxSide || image->height > kMaxSide) {
    throw fail("more than 16384 texels a side");
  }
  DecodedImage base{.width = image->width, .height = image->height};
  const std::size_t count = image->rgba.size() / 4;
  base.rgb.reserve(3 * count);
  base.alpha.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* texel = image->rgba.data() + 4 * k;
    base.rgb.insert(base.rgb.end(), texel, texel + 3);
    base.alpha.push_back(texel[3]);
  }
  if (std::ranges::all_of(base.alpha, [](std::uint8_t a) { return a == 255; })) base.alpha = {};
  return base;
}

}  // namespace rebounce
