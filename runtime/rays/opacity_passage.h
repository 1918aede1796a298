#pragma once

// What a ray meets at a triangle that has an opacity map.

#include <bit>
#include <cstdint>
#include <span>

#include "rebounce/types.h"
#include "runtime/rays/sampling.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {

/// The part of light that `map` stops at the barycentric weights `u`, `v`, [0, 1].
inline float stopped_part(std::span<const std::uint8_t> map, float u, float v) {
  const std::uint8_t opacity = map[micro_triangle_at(opacity_map_level(map.size()), u, v)];
  return static_cast<float>(opacity) / OpacityMaps::kOpaque;
}

/// Whether a ray stops where `part` of the light does: always for 1, never for 0, in between by a
/// hash of ray and triangle that never changes.
inline bool stops_by_chance(const Float3& origin, const Float3& direction, std::uint32_t triangle,
                            float part) {
  const auto bits = [](float x, float y) {
    return (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(x)) << 32) |
           std::bit_cast<std::uint32_t>(y);
  };
  if (part <= 0 || part >= 1) return part > 0;
  std::uint64_t mixed = mix_bits(triangle ^ bits(origin[0], origin[1]));
  mixed = mix_bits(mixed ^ bits(origin[2], direction[0]));
  mixed = mix_bits(mixed ^ bits(direction[1], direction[2]));
  return static_cast<float>(mixed >> 40) * 0x1p-24F < part;
}

}  // namespace rebounce
