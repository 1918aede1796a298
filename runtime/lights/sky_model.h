#pragma once

// What skies of the CIE standard general sky look like.

#include <glm/glm.hpp>

namespace rebounce {

/// Gradation 1 + a exp(b / cos Z), indicatrix 1 + c (exp(d X) - exp(d pi / 2)) + e cos² X.
struct SkyType {
  double a, b, c, d, e;
};

/// A sky of the CIE standard general sky (ISO 15469:2004), without its sun.
class CieSky {
 public:
  /// `type` and `sun_direction` as cie_sky takes them; throws Error if one is out of range.
  CieSky(int type, const glm::dvec3& sun_direction);

  /// The luminance in parts of that of the zenith, in a direction above the horizon, unit.
  double luminance(const glm::dvec3& direction) const;

 private:
  double gradation(double cosine) const;
  double indicatrix(double cosine) const;

  SkyType type_;
  glm::dvec3 to_sun_;
  double zenith_;
};

}  // namespace rebounce
