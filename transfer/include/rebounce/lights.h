#pragma once

// Lamps, and luminaires by their photometric data.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// How the luminous intensity of a luminaire depends on direction, in the type C photometry of
/// ANSI/IES LM-63: vertical angles from its axis (0: along it), horizontal ones around it.
/// Immutable once made, shared by all lights that have it.
struct IntensityProfile {
  std::vector<float> vertical;    ///< radians, ascending, within [0, pi]; at least one
  std::vector<float> horizontal;  ///< radians, ascending from 0; at least one
  std::vector<float> candela;     ///< [horizontal][vertical], each >= 0
  /// True if the last horizontal angle is a quarter or half of a turn: beyond it the luminaire
  /// repeats itself, mirrored. Otherwise the last angle is a whole turn, or there is only one.
  bool mirrored = false;

  /// Intensity in candela, interpolated bilinearly; 0 beyond the vertical angles. `vertical_angle`
  /// in [0, pi], `horizontal_angle` of any size, in radians.
  float intensity(float vertical_angle, float horizontal_angle) const;
};

/// Reads the photometric data of a luminaire from the text of an IES file (ANSI/IES LM-63-1986 to
/// -2019, type C photometry), with its multiplier, its ballast factor and, before 1995, its
/// ballast-lamp factor; keywords and the lamp's shape are skipped. `name` stands for the file in
/// messages. Throws Error if the text is no such file, is of type A or B, or has angles that are
/// not those of a type C measurement.
std::shared_ptr<const IntensityProfile> parse_ies_profile(std::string_view text,
                                                          const std::string& name);

enum class LightType : std::uint8_t { kPoint, kSpot, kDirectional, kSphere, kRectangle, kDisc };

/// A lamp in the world. Points, spots and directional lights have the fields and units of
/// KHR_lights_punctual; spheres, rectangles and discs shine with the same luminance from all of
/// their surface.
struct Light {
  LightType type = LightType::kPoint;
  std::string name;
  Float3 position{0, 0, 0};  ///< metres, the middle; not used by directional lights
  Float3 direction{0, -1,
                   0};  ///< unit; the way the light travels; the side of a rectangle or
                        ///< disc that shines; not used by spheres, and by points without a profile
  Float3 color{1, 1, 1};  ///< linear Rec.709, each >= 0
  float intensity = 1;    ///< >= 0; candela (point, spot), lux (directional), candela per m²
                          ///< (sphere, rectangle, disc); with a profile a factor of its candelas
  float range = 0;        ///< metres; beyond it no light arrives; 0 means unlimited
  float inner_cone_angle = 0;  ///< radians from the axis: full intensity inside (spot); >= 0
  float outer_cone_angle = 0.785398163F;  ///< none outside; at least the inner one, at most pi/2
  float radius = 0;                       ///< metres, > 0 (sphere, disc)
  Float2 size{0, 0};                      ///< metres, > 0: along `tangent`, across it (rectangle)
  /// The way of the first side of a rectangle, and of horizontal angle 0 of a profile. It is made
  /// perpendicular to `direction`, and must not be parallel to it.
  Float3 tangent{1, 0, 0};
  std::shared_ptr<const IntensityProfile> profile;  ///< of a luminaire (point, spot); may be null
};

/// Whether KHR_lights_punctual has such a lamp: a point, a spot or a directional light without a
/// profile. Transfer files hold no others.
inline bool is_punctual(const Light& light) {
  return light.type <= LightType::kDirectional && !light.profile;
}

}  // namespace rebounce
