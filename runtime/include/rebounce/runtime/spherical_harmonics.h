#pragma once

#include <array>

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

}  // namespace rebounce
