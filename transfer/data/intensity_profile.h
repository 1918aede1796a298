#pragma once

#include <vector>

namespace rebounce {

/// How the luminous intensity of a luminaire depends on direction, in the type C photometry of
/// ANSI/IES LM-63: vertical angles from its axis (0: along it), horizontal ones around it.
/// Immutable once made, shared by all lights that have it.
struct IntensityProfile {
  std::vector<float> vertical;    ///< radians, ascending, within [0, pi]; at least one
  std::vector<float> horizontal;  ///< radians, ascending from 0; at least one
  std::vector<float> candela;     ///< [horizontal][vertical], each >= 0
  /// The luminaire repeats itself, mirrored, beyond the last horizontal angle: that is a quarter or
  /// half of a turn. Otherwise it is a whole one, or the only one.
  bool mirrored = false;

  /// Intensity in candela, interpolated bilinearly; 0 beyond the vertical angles. `vertical_angle`
  /// in [0, pi], `horizontal_angle` of any size, in radians.
  float intensity(float vertical_angle, float horizontal_angle) const;
};

}  // namespace rebounce
