#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rebounce/outputs.h"

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

/// The spherical harmonics of degree 4, (4,-4) to (4,4), with matching signs.
inline Harmonics degree_4_harmonics(const Float3& d) {
  const auto [x, y, z] = d;
  const float xx = x * x, yy = y * y, zz = z * z;
  return {2.503343F * x * y * (xx - yy),
          1.770131F * y * z * (3 * xx - yy),
          0.946175F * x * y * (7 * zz - 1),
          0.669047F * y * z * (7 * zz - 3),
          0.105786F * (zz * (35 * zz - 30) + 3),
          0.669047F * x * z * (7 * zz - 3),
          0.473087F * (xx - yy) * (7 * zz - 1),
          1.770131F * x * z * (xx - 3 * yy),
          0.625836F * (xx * (xx - 3 * yy) - yy * (3 * xx - yy))};
}

/// The degrees 0 and 1 of light from a part of the sphere.
struct LightSpot {
  Float3 direction{0, 0, 0};  ///< mean, unit; 0 if there is no light
  float amount = 0;           ///< radiance times solid angle
  /// Mean cosine to `direction`, 0 to 1: 1 for a point, 1/2 for a hemisphere.
  float sharpness = 0;
};

template <std::size_t N>
LightSpot spot_of(const std::array<float, N>& weight) {
  static_assert(N >= 4);
  const float amount = weight[0] / 0.282095F;
  const float length =
      std::sqrt(weight[1] * weight[1] + weight[2] * weight[2] + weight[3] * weight[3]);
  if (!(amount > 0 && length > 0)) return {};
  return {.direction = {weight[3] / length, weight[1] / length, weight[2] / length},
          .amount = amount,
          .sharpness = std::min(length / (0.488603F * amount), 1.0F)};
}

/// Degree 4 of a small part of the sphere whose degrees 0 and 1 are `weight`, as for a Gaussian
/// spot around the mean direction. Degree l of the Gauss-Weierstrass kernel of the sphere is exp(-l
/// (l + 1) t), so degree 4 falls with the tenth power of the ratio of degree 1 to degree 0. It
/// nearly vanishes for a hemisphere, and is zero if weight[0] is.
template <std::size_t N>
Harmonics degree_4_of_spot(const std::array<float, N>& weight) {
  const LightSpot spot = spot_of(weight);
  if (spot.amount == 0) return {};
  Harmonics degree_4 = degree_4_harmonics(spot.direction);
  const float squared = spot.sharpness * spot.sharpness;
  const float factor = spot.amount * squared * squared * squared * squared * squared;
  for (float& y : degree_4) y *= factor;
  return degree_4;
}

/// Those of degree 0 to 2, then those of degree 4.
inline std::array<float, kIrradianceHarmonicCount> irradiance_harmonics(const Float3& d) {
  std::array<float, kIrradianceHarmonicCount> all;
  const auto rest = std::ranges::copy(spherical_harmonics(d), all.begin()).out;
  std::ranges::copy(degree_4_harmonics(d), rest);
  return all;
}

/// The factors of the cosine lobe: pi, 2 pi / 3, pi / 4, -pi / 24 (ibid., eq. 8).
inline constexpr std::array<float, kIrradianceHarmonicCount> kCosineLobe = {
    3.141593F,  2.094395F,  2.094395F,  2.094395F,  0.785398F,  0.785398F,
    0.785398F,  0.785398F,  0.785398F,  -0.130900F, -0.130900F, -0.130900F,
    -0.130900F, -0.130900F, -0.130900F, -0.130900F, -0.130900F, -0.130900F};

/// The irradiance in lx on a surface with unit `normal`, for light given by the first N
/// coefficients of the irradiance_harmonics in cd/m² (ibid., eq. 7). Never negative, although the
/// series may be.
template <std::size_t N>
Float3 irradiance_of(const std::array<Float3, N>& light, const Float3& normal) {
  const auto y = irradiance_harmonics(normal);
  Float3 sum{0, 0, 0};
  for (std::size_t k = 0; k < N; ++k) {
    for (std::size_t c = 0; c < kChannelCount; ++c) sum[c] += kCosineLobe[k] * y[k] * light[k][c];
  }
  for (float& x : sum) x = std::max(x, 0.0F);
  return sum;
}

}  // namespace rebounce
