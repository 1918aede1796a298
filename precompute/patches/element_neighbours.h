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

/// Pairs of elements that share an edge and lie on the same side of the surface: they run along the
/// edge in opposite directions. Ascending, each once.
Pairs find_edge_neighbours(std::span<const Uint3> corner);

/// For each point the `count` nearest others within `reach` metres. Ascending, each once.
Pairs find_near_pairs(std::span<const Float3> point, std::size_t count, float reach);

/// The line of sight between two points of the surface, in three rays: up from each point along its
/// normal, by a fraction of the distance, and across between the upper points. A rounded surface
/// therefore does not hide its own points from each other.
std::array<Ray, 3> line_of_sight(const PatchPoint& a, const PatchPoint& b, const RayTracer& tracer);

/// The triangle of the surface that blocks a line of sight, or kNone.
std::uint32_t find_between(const PatchPoint& a, const PatchPoint& b, const RayTracer& tracer);

}  // namespace rebounce
