#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/rays/patch_points.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

/// Pairs of elements or patches, the smaller number first.
using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Pairs of elements that meet at an edge and are on the same side of the surface: they run along
/// the edge in opposite ways. Ascending, each once.
Pairs find_edge_neighbours(std::span<const Uint3> corner);

/// For each point the `count` nearest others within `reach` metres. Ascending, each once.
Pairs find_near_pairs(std::span<const Float3> point, std::size_t count, float reach);

/// The line of sight between two points of the surface: across between points above them, and up to
/// these along each one's normal by a part of the distance, so that a rounded surface does not hide
/// its own points from each other.
std::array<Ray, 3> line_of_sight(const PatchPoint& a, const PatchPoint& b, const RayTracer& tracer);

/// Finds what stands in a line of sight: a triangle of the surface, or kNone.
std::uint32_t find_between(const PatchPoint& a, const PatchPoint& b, const RayTracer& tracer);

}  // namespace rebounce
