#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "rebounce/scene_data.h"

namespace rebounce {

/// A decoded texture with its mip levels.
class FilteredTexture {
 public:
  /// Throws Error if the image cannot be decoded or is too large.
  explicit FilteredTexture(const Texture& texture);

  /// The linear colour at `texcoord`, trilinearly filtered over a footprint of `texcoord_width`
  /// texture coordinates.
  glm::vec3 sample(const glm::vec2& texcoord, float texcoord_width) const;

  /// Alpha in [0, 1] at `texcoord`, bilinearly filtered; 1 if the image has none.
  float alpha(const glm::vec2& texcoord) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> rgb{};  // sRGB
  };

  static Level half_size(const Level& level);

  /// Interpolates `texel`(index) between the four texels of `level` around `texcoord`.
  template <typename TexelValue>
  auto bilinear(const Level& level, const glm::vec2& texcoord, const TexelValue& texel) const;
  glm::vec3 bilinear_color(const Level& level, const glm::vec2& texcoord) const;

  std::vector<Level> levels_;
  std::vector<std::uint8_t> alpha_;  ///< of the finest level; empty if it is 255 everywhere
  TextureWrap wrap_s_, wrap_t_;
};

}  // namespace rebounce
