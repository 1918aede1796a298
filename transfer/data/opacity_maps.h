#pragma once

// How much of the light that meets a triangle it stops, place by place: what is called an opacity
// micromap (H. Gruen, C. Benthin and S. Woop, "Sub-triangle opacity masks for faster ray tracing of
// transparent objects", 2020), with a fraction instead of a bit, so that glass and the rims of
// leaves keep their mean.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// The opacity of some triangles by micro-triangles. A map of level L has 4^L of them: each level
/// quarters a triangle at the middles of its sides, and the quarters' maps follow one another in
/// the order first vertex, middle, second vertex, third vertex. The middle one is upside down: its
/// first vertex is opposite the triangle's.
struct OpacityMaps {
  static constexpr int kMaxLevel = 5;
  static constexpr std::uint8_t kOpaque = 255;  ///< stops everything; 0 stops nothing

  /// [t] the map of each triangle, or kNone for an opaque one. Empty where all are opaque.
  std::vector<std::uint32_t> triangle_map;
  std::vector<std::uint32_t> begin;   ///< [m + 1] map k is [begin[k], begin[k + 1]) of `opacity`
  std::vector<std::uint8_t> opacity;  ///< by micro-triangle, of kOpaque

  bool empty() const { return triangle_map.empty(); }
  std::size_t map_count() const { return begin.empty() ? 0 : begin.size() - 1; }

  std::span<const std::uint8_t> map(std::uint32_t index) const {
    return {opacity.data() + begin[index], opacity.data() + begin[index + 1]};
  }

  /// The map of a triangle, of size 4^level; empty if it is opaque.
  std::span<const std::uint8_t> of_triangle(std::uint32_t triangle) const {
    if (empty() || triangle_map[triangle] == kNone) return {};
    return map(triangle_map[triangle]);
  }

  /// The part of a triangle that stops light, [0, 1].
  double stopping_part(std::uint32_t triangle) const;
};

/// True if a map can have this many micro-triangles: 4^level.
constexpr bool is_opacity_map_size(std::size_t size) {
  return std::has_single_bit(size) && std::countr_zero(size) % 2 == 0 &&
         std::countr_zero(size) <= 2 * OpacityMaps::kMaxLevel;
}

/// The level of a map of 4^level micro-triangles; 0 without one.
constexpr int opacity_map_level(std::size_t size) {
  return size == 0 ? 0 : std::countr_zero(size) / 2;
}

/// The mean of a map as a fraction; 1 for an empty one.
double mean_opacity(std::span<const std::uint8_t> map);

/// Which micro-triangle of a map of this level has the place with barycentric weights u and v of
/// the second and third vertex.
std::uint32_t micro_triangle_at(int level, float u, float v);

/// Barycentric weights of the second and third vertex.
struct TrianglePlace {
  double u, v;
};

/// Where on the triangle the place `inside` a micro-triangle is.
TrianglePlace place_in_micro_triangle(int level, std::uint32_t micro_triangle,
                                      TrianglePlace inside);

}  // namespace rebounce
