#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "rebounce/transfer/light_probes.h"

namespace rebounce {

/// The spherical harmonics of the unit vector `d`, orthonormal over the sphere, with the constants
/// and signs of R. Ramamoorthi, P. Hanrahan, "An efficient representation for irradiance
/// environment maps", SIGGRAPH 2001, eq. 3.
inline Harmonics spherical_harmonics(const Float3& d) {
  const auto [x, y, z] = d;
  return {0.282095F,
          0.488603F * y,
          0.488603F * z,
          0.488603F * x,
          1.092548F * x * y,
          1.092548F * y * z,
          0.315392F * (3 * z * z - 1),
          1.092548F * x * z,
          0.546274F * (x * x - y * y)};
}

/// What the cosine lobe does to each harmonic, by degree: pi, 2 pi / 3, pi / 4 (ibid., eq. 8).
inline constexpr Harmonics kCosineLobe = {3.141593F, 2.094395F, 2.094395F, 2.094395F, 0.785398F,
                                          0.785398F, 0.785398F, 0.785398F, 0.785398F};

/// The irradiance (lx) on a surface that faces `normal` (unit) of light given by the first N
/// coefficients, lx/pi (ibid., eq. 7); never negative, though the series may undershoot.
template <std::size_t N>
Float3 irradiance_of(const std::array<Float3, N>& light, const Float3& normal) {
  const Harmonics y = spherical_harmonics(normal);
  Float3 sum{0, 0, 0};
  for (std::size_t k = 0; k < N; ++k) {
    for (std::size_t c = 0; c < kChannelCount; ++c) sum[c] += kCosineLobe[k] * y[k] * light[k][c];
  }
  for (float& x : sum) x = std::max(x, 0.0F);
  return sum;
}

}  // namespace rebounce
