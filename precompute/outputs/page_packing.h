#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace rebounce {

/// A rectangle of a texture, texels.
struct Tile {
  glm::uvec2 corner{0};  ///< smallest x and y
  glm::uvec2 extent{0};
};

/// Packs rectangles into a texture of `size` x `size` texels, as large as they fit, in proportion
/// to `extent` (> 0) but with sides of at least `least_side`. Returns one tile for each; empty if
/// they do not fit at their least size.
std::vector<Tile> pack_pages(std::span<const glm::dvec2> extent, std::uint32_t size,
                             std::uint32_t least_side);

}  // namespace rebounce
