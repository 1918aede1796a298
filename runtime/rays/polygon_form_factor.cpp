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

/// Lambert's term for the edge from `a` to `b`, whose lengths are given: the angle that it subtends
/// times what the unit normal of its plane with the receiver has of `normal`.
float edge_term(const glm::vec3& a, const glm::vec3& b, float length_a, float length_b,
                const glm::vec3& normal) {
  const glm::vec3 axis = glm::cross(a, b);
  const float product = length_a * length_b, cosine = glm::dot(a, b) / product;
  if (!(cosine >= 0)) {  // an obtuse angle, or a corner at the receiver
    const float sine = glm::length(axis);
    return sine > 0 ? std::atan2(sine, glm::dot(a, b)) * glm::dot(axis, normal) / sine : 0;
  }
  return acute_edge_term(cosine, glm::dot(axis, normal), product);
}

}  // namespace

float point_to_polygon_form_factor(const glm::vec3& position, const glm::vec3& normal,
                                   std::span<const glm::vec3> corner) {
  assert(corner.size() <= kMaxCorners);
  const CutPolygon polygon = above_horizon(position, normal, corner);
  std::array<float, kMaxCorners + 1> length;
  for (std::size_t k = 0; k < polygon.count; ++k) length[k] = glm::length(polygon.corner[k]);
  float sum = 0;
  for (std::size_t k = 0; k < polygon.count; ++k) {
    const std::size_t next = k + 1 < polygon.count ? k + 1 : 0;
    sum += edge_term(polygon.corner[k], polygon.corner[next], length[k], length[next], normal);
  }
  return std::clamp(std::abs(sum) / (2 * std::numbers::pi_v<float>), 0.0F, 1.0F);
}

}  // namespace rebounce
