#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/sky_harmonics.h"

namespace rebounce {

/// Real spherical harmonics of degree 0 to 2: coefficients or values, in the order
/// (0,0), (1,-1), (1,0), (1,1), (2,-2), (2,-1), (2,0), (2,1), (2,2).
inline constexpr std::size_t kHarmonicCount = 9;
using Harmonics = std::array<float, kHarmonicCount>;

/// Points in the air, and for each the linear map from the radiosity of the patches to the
/// incoming radiance there, as coefficients of spherical harmonics.
struct LightProbes {
  std::vector<Float3> position;       ///< [p] metres
  std::vector<std::uint8_t> valid;    ///< [p] 0: within a wall or behind surfaces, without entries
  std::vector<Harmonics> sky;         ///< [p] of a sky of luminance 1
  SkyHarmonics<Harmonics> sky_cells;  ///< [p] may be empty: then the sky is taken for uniform
  /// What probe k sees of patches is [entry_begin[k], entry_begin[k + 1]): with radiosity B in lx
  /// the coefficients are the sum of entry_weight x B[entry_patch], in cd/m².
  std::vector<std::uint32_t> entry_begin = {0};  ///< [p + 1]
  std::vector<std::uint32_t> entry_patch;
  std::vector<Harmonics> entry_weight;
  /// Probes along x, y and z, x fastest, evenly spaced from the first to the last; zeros if they
  /// are no grid.
  Uint3 grid{0, 0, 0};
  std::size_t patch_count = 0;  ///< n: entry_patch is below it

  std::size_t size() const { return position.size(); }
};

}  // namespace rebounce
