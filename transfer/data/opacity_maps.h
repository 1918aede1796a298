#pragma once

// How much of the light that meets a triangle it stops, place by place: what is called an opacity
// micromap (H. Gruen, C. Benthin and S. Woop, "Sub-triangle opacity masks for faster ray tracing of
// transparent objects", 2020), with a fraction instead of a bit, so that glass and the rims of
// leaves keep their mean.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rebounce/scene_data.h"

namespace rebounce {

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
