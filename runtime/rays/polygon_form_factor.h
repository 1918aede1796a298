#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <span>

namespace rebounce {

/// Lambert's term for an edge that subtends at most a right angle: the angle times what the unit
/// normal of its plane with the receiver has of the receiver's. `cosine`: of the angle;
/// `axis_height`: of the cross product of both ends along the receiver's normal; `product`: of the
/// ends' lengths.
///
/// The arc cosine is sqrt(1 - x) times a polynomial, to 2e-8 (M. Abramowitz, I. Stegun, "Handbook
/// of Mathematical Functions", 1964, 4.4.46). So the angle over its sine needs no small difference.
inline float acute_edge_term(float cosine, float axis_height, float product) {
  float polynomial = -0.0012624911F;
  polynomial = polynomial * cosine + 0.0066700901F;
  polynomial = polynomial * cosine - 0.0170881256F;
  polynomial = polynomial * cosine + 0.0308918810F;
  polynomial = polynomial * cosine - 0.0501743046F;
  polynomial = polynomial * cosine + 0.0889789874F;
  polynomial = polynomial * cosine - 0.2145988016F;
  polynomial = polynomial * cosine + 1.5707963050F;
  return polynomial / (std::sqrt(1 + cosine) * product) * axis_height;
}

/// The form factor from a differential element at `position` with unit `normal` to a flat convex
/// polygon with three or four corners in order. Both sides of the polygon count; the part below the
/// element's horizon is cut off. In [0, 1].
float point_to_polygon_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                   std::span<const glm::vec3> corner);

}  // namespace rebounce
