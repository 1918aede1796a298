#include "runtime/demo/image/filtered_texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/demo/image/decoded_image.h"
#include "runtime/demo/image/srgb.h"

namespace rebounce {
namespace {

float byte_to_linear(std::uint8_t value) {
  static const auto table = [] {
    std::array<float, 256> linear;
    for (int k = 0; k < 256; ++k) linear[k] = srgb_to_linear(static_cast<float>(k) / 255);
    return linear;
  }();
  return table[value];
}

int wrapped(int texel, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::kClampToEdge) return std::clamp(texel, 0, size - 1);
  const int period = wrap == TextureWrap::kMirroredRepeat ? 2 * size : size;
  const int inside = ((texel % period) + period) % period;
  return inside < size ? inside : period - 1 - inside;
}

// Moves a coordinate near zero, so that its texel index fits an int.
float reduced(float texcoord, TextureWrap wrap) {
  if (!std::isfinite(texcoord)) return 0;
  if (wrap == TextureWrap::kClampToEdge) return std::clamp(texcoord, -1.0F, 2.0F);
  return std::fmod(texcoord, 2.0F);
}

}  // namespace

FilteredTexture::FilteredTexture(const Texture& texture)
    : wrap_s_(texture.wrap_s), wrap_t_(texture.wrap_t) {
  DecodedImage image = decode_image(texture);
  alpha_ = std::move(image.alpha);
  levels_.push_back({image.width, image.height, std::move(image.rgb)});
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    levels_.push_back(half_size(levels_.back()));
  }
}

FilteredTexture::Level FilteredTexture::half_size(const Level& level) {
  Level half{.width = std::max(1, level.width / 2), .height = std::max(1, level.height / 2)};
  half.rgb.resize(std::size_t{3} * half.width * half.height);
  const auto texel = [&](int x, int y, int channel) {
    x = std::min(x, level.width - 1);
    y = std::min(y, level.height - 1);
    return byte_to_linear(level.rgb[(std::size_t{3} * y) * level.width + 3 * x + channel]);
  };
  std::size_t out = 0;
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        half.rgb[out++] =
            to_srgb_byte(0.25F * (texel(2 * x, 2 * y, c) + texel(2 * x + 1, 2 * y, c) +
                                  texel(2 * x, 2 * y + 1, c) + texel(2 * x + 1, 2 * y + 1, c)));
      }
    }
  }
  return half;
}

template <typename TexelValue>
auto FilteredTexture::bilinear(const Level& level, const glm::vec2& texcoord,
                               const TexelValue& texel) const {
  const float x = reduced(texcoord.x, wrap_s_) * static_cast<float>(level.width) - 0.5F;
  const float y = reduced(texcoord.y, wrap_t_) * static_cast<float>(level.height) - 0.5F;
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  const auto at = [&](int column, int row) {
    column = wrapped(column, level.width, wrap_s_);
    row = wrapped(row, level.height, wrap_t_);
    return texel(static_cast<std::size_t>(row) * level.width + column);
  };
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  return glm::mix(glm::mix(at(left, top), at(left + 1, top), fx),
                  glm::mix(at(left, top + 1), at(left + 1, top + 1), fx), fy);
}

glm::vec3 FilteredTexture::bilinear_color(const Level& level, const glm::vec2& texcoord) const {
  return bilinear(level, texcoord, [&](std::size_t index) {
    const std::uint8_t* rgb = &level.rgb[3 * index];
    return glm::vec3(byte_to_linear(rgb[0]), byte_to_linear(rgb[1]), byte_to_linear(rgb[2]));
  });
}

float FilteredTexture::alpha(const glm::vec2& texcoord) const {
  if (alpha_.empty()) return 1;
  return bilinear(levels_[0], texcoord,
                  [&](std::size_t index) { return static_cast<float>(alpha_[index]) / 255; });
}

glm::vec3 FilteredTexture::sample(const glm::vec2& texcoord, float texcoord_width) const {
  const int side = std::max(levels_[0].width, levels_[0].height);
  const float texels = std::max(1.0F, texcoord_width * static_cast<float>(side));
  const float top_level = static_cast<float>(levels_.size() - 1);
  const float level = std::clamp(std::log2(texels), 0.0F, top_level);
  const auto fine = static_cast<std::size_t>(level);
  const float between = level - static_cast<float>(fine);
  const glm::vec3 sharp = bilinear_color(levels_[fine], texcoord);
  if (between == 0) return sharp;
  return glm::mix(sharp, bilinear_color(levels_[fine + 1], texcoord), between);
}

}  // namespace rebounce
