#pragma once

#include <cstdint>
#include <vector>

#include "rebounce/precompute/scene.h"

namespace rebounce {

/// Which sides of a triangle take part in the exchange of light.
enum Sides : std::uint8_t { kFrontSide = 1, kBackSide = 2, kBothSides = 3 };

/// Finds the sides of each triangle [t] that need patches.
///
/// A one-sided triangle has its front. Of a double-sided one, a side that sees no other surface
/// (the outside of a room's wall) neither gives light to anything nor gets any back, so leaving it
/// out of the system changes nothing: it is dropped when none of its rays meets a side that
/// reflects. At least one side of every triangle is kept. Deterministic.
std::vector<std::uint8_t> find_lit_sides(const Scene& scene);

}  // namespace rebounce
