#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/sky_harmonics.h"

namespace rebounce {

/// Coefficients or values of the real spherical harmonics of degree 0 and 1, in the order (0,0),
/// (1,-1), (1,0), (1,1), with the constants of spherical_harmonics.h.
inline constexpr std::size_t kLinearHarmonicCount = 4;
using LinearHarmonics = std::array<float, kLinearHarmonicCount>;

/// Where the light comes from that arrives at the patches: for each the linear map from the
/// radiosity of the patches to the radiance over its hemisphere (the mean over its area), as
/// spherical harmonics in the world's axes.
struct SurfaceHarmonics {
  std::vector<LinearHarmonics> sky;         ///< [n] of a sky of luminance 1
  SkyHarmonics<LinearHarmonics> sky_cells;  ///< [n] may be empty: then the sky is taken for uniform
  /// What patch i sees is [entry_begin[i], entry_begin[i + 1]): with radiosity B in lx the
  /// coefficients are the sum of entry_weight x B[entry_patch], in cd/m².
  std::vector<std::uint32_t> entry_begin;  ///< [n + 1]
  std::vector<std::uint32_t> entry_patch;
  std::vector<LinearHarmonics> entry_weight;

  bool empty() const { return sky.empty(); }
};

}  // namespace rebounce
