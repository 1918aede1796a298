#pragma once

#include <cstdint>
#include <vector>

#include "transfer/data/sky_cells.h"

namespace rebounce {

/// What places see of each cell of the sky (sky_cells.h), as spherical harmonics: for a sky whose
/// cell c has luminance L(c) in cd/m², the coefficients at place i are the sum of entry_weight x
/// L(entry_cell) over [entry_begin[i], entry_begin[i + 1]), in cd/m².
template <typename Weight>
struct SkyHarmonics {
  std::vector<std::uint32_t> entry_begin;  ///< [places + 1]
  std::vector<std::uint8_t> entry_cell;    ///< ascending for each place
  std::vector<Weight> entry_weight;

  bool empty() const { return entry_begin.empty(); }
};

}  // namespace rebounce
