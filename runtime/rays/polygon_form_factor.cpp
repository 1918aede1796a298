// Lambert's formula for the irradiance from a polygon of uniform luminance, as radiosity uses it:
// D. Baum, H. Rushmeier, J. Winget, "Improving Radiosity Solutions Through the Use of Analytically
// Determined Form-Factors", SIGGRAPH 1989.

#include "runtime/rays/polygon_form_factor.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

constexpr std::size_t kMaxCorners = 4;

// A polygon cut by a plane, which adds one corner at most.
struct CutPolygon {
  std::array<glm::vec3, kMaxCorners + 1> corner;
  std::size_t count = 0;
  void add(const glm::vec3& v) {
    // A polygon that is not exactly flat could be cut more than twice.
    if (count < corner.size()) corner[count++] = v;
  }
};

CutPolygon above_horizon(const glm::vec3& position, const glm::vec3& normal,
                         std::span<const glm::vec3> corner) {
  CutPolygon polygon;
  for (std::size_t k = 0; k < corner.size(); ++k) {
    const glm::vec3 ray = corner[k] - position;
    const glm::vec3 next = corner[(k + 1) % corner.size()] - position;
    const float height = glm::dot(ray, normal), next_height = glm::dot(next, normal);
    if (height >= 0) polygon.add(ray);
    if ((height > 0 && next_height < 0) || (height < 0 && next_height > 0)) {
      polygon.add(glm::mix(ray, next, height / (height - next_height)));
    }
  }
  return polygon;
}

}  // namespace

float point_to_polygon_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                   std::span<const glm::vec3> corner) {
  assert(corner.size() <= kMaxCorners);
  const CutPolygon polygon = above_horizon(position, normal, corner);
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
