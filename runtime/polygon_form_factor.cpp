// Lambert's formula for the irradiance from a polygon of uniform luminance, as radiosity uses it:
// D. Baum, H. Rushmeier, J. Winget, "Improving Radiosity Solutions Through the Use of Analytically
// Determined Form-Factors", SIGGRAPH 1989.

#include "rebounce/runtime/polygon_form_factor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

// A triangle cut by a plane: three or four corners, or none.
struct Polygon {
  std::array<glm::vec3, 4> corner;
  std::size_t count = 0;
  void add(const glm::vec3& v) { corner[count++] = v; }
};

Polygon above_horizon(const glm::vec3& position, const glm::vec3& normal,
                      const std::array<glm::vec3, 3>& triangle) {
  std::array<glm::vec3, 3> ray;
  std::array<float, 3> height;
  for (std::size_t k = 0; k < 3; ++k) {
    ray[k] = triangle[k] - position;
    height[k] = glm::dot(ray[k], normal);
  }
  Polygon polygon;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (height[k] >= 0) polygon.add(ray[k]);
    if ((height[k] > 0 && height[next] < 0) || (height[k] < 0 && height[next] > 0)) {
      polygon.add(glm::mix(ray[k], ray[next], height[k] / (height[k] - height[next])));
    }
  }
  return polygon;
}

}  // namespace

float point_to_triangle_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                    const std::array<glm::vec3, 3>& triangle) {
  const Polygon polygon = above_horizon(position, normal, triangle);
  float sum = 0;
  for (std::size_t k = 0; k < polygon.count; ++k) {
    const glm::vec3& a = polygon.corner[k];
    const glm::vec3& b = polygon.corner[(k + 1) % polygon.count];
    const glm::vec3 axis = glm::cross(a, b);
    const float sine = glm::length(axis);
    if (sine > 0) sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(axis, normal) / sine;
  }
  return std::clamp(std::abs(sum) / (2 * std::numbers::pi_v<float>), 0.0F, 1.0F);
}

}  // namespace rebounce
