#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// For each vertex the number of its position in [0, count), equal for vertices at the same place.
struct WeldedPositions {
  std::vector<std::uint32_t> id;  ///< [v]
  std::uint32_t count = 0;
};
WeldedPositions weld_positions(std::span<const Float3> position);

}  // namespace rebounce
