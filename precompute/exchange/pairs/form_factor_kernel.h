#pragma once

// The geometry of form factors: how much light two flat polygons exchange with nothing between
// them.

#include <array>
#include <glm/glm.hpp>
#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// A flat triangle with the values that the kernel needs; the front is the side where it is
/// counter-clockwise.
struct FlatTriangle {
  std::array<glm::dvec3, 3> vertex;
  glm::dvec3 normal{0};      ///< unit
  glm::dvec3 centroid{0};    ///< metres
  double area = 0;           ///< m²
  double radius = 0;         ///< of the sphere around the centroid, metres
  double stopping_part = 1;  ///< fraction of the area that stops light; the kernels ignore it

  FlatTriangle() = default;
  FlatTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

  double stopping_area() const { return area * stopping_part; }
};

/// Exchange area A_a F_ab = A_b F_ba in m² between the fronts of two triangles with nothing between
/// them: symmetric in a and b up to rounding, >= 0.
///
/// If the triangles are small for their distance, this is a product of quadrature rules whose
/// degree follows from their error terms. Otherwise, and where one triangle cuts the plane of the
/// other, it is the double contour integral of ln r over the parts in front of both planes, with
/// the inner integral in closed form (E. M. Sparrow, "A new and simpler formulation for radiative
/// angle factors", 1963). `tolerance` is the relative error that the choice aims at.
double unoccluded_exchange_area(const FlatTriangle& a, const FlatTriangle& b,
                                double tolerance = 3e-4);

/// The same by the contour integral alone, at any distance.
double contour_exchange_area(const FlatTriangle& a, const FlatTriangle& b);

/// The integrand of the area formulation (Burenius, eq. 4.13): cos cos / (pi r²); 0 for points
/// behind a plane.
inline double point_kernel(const glm::dvec3& x, const glm::dvec3& nx, const glm::dvec3& y,
                           const glm::dvec3& ny) {
  const glm::dvec3 d = y - x;
  const double cx = glm::dot(nx, d), cy = -glm::dot(ny, d);
  if (cx <= 0 || cy <= 0) return 0;
  const double r2 = glm::dot(d, d);
  return cx * cy / (3.14159265358979323846 * r2 * r2);
}

}  // namespace rebounce
