// J. R. Howell, "A catalog of radiation heat transfer configuration factors", B-43: element to
// sphere, also where the element's plane cuts it.

#include "sphere_form_factor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

/// `sine_squared` of the half angle in which the sphere is seen, `cosine` of the angle between the
/// normal and its middle; the horizon cuts the sphere.
double cut_sphere(double sine_squared, double cosine) {
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double cotangent_of_half = std::sqrt(1 / sine_squared - 1);
  const double cosine_of_half = std::sqrt(1 - sine_squared);
  const double across = std::sqrt(std::max(0.0, 1 - cosine * cosine / sine_squared));
  const double turn = std::acos(std::clamp(-cotangent_of_half * cosine / sine, -1.0, 1.0));
  const double lens = std::asin(std::clamp(cosine_of_half / sine, -1.0, 1.0));
  return 0.5 +
         (sine_squared * (cosine * turn - cotangent_of_half * across) - lens) / std::numbers::pi;
}

}  // namespace

float point_to_sphere_form_factor(const glm::vec3& to_center, const glm::vec3& normal,
                                  float radius) {
  const float distance_squared = glm::dot(to_center, to_center);
  const float sine_squared = radius * radius / distance_squared;
  if (!(sine_squared < 1)) return 1;
  const float height = glm::dot(to_center, normal);
  if (height <= -radius) return 0;
  const float cosine = height / std::sqrt(distance_squared);
  if (height >= radius) return sine_squared * cosine;
  return std::max(0.0F, static_cast<float>(cut_sphere(sine_squared, cosine)));
}

}  // namespace rebounce
