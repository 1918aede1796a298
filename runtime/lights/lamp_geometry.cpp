#include "runtime/lights/lamp_geometry.h"

#include <algorithm>
#include <cmath>

#include "runtime/rays/float3_glm.h"

namespace rebounce {
namespace {

constexpr float kLeastDivisor = 1e-30F;  // of a place at the point itself

}  // namespace

Sides sides_around(const glm::vec3& axis, const glm::vec3& tangent) {
  glm::vec3 across = tangent - glm::dot(tangent, axis) * axis;
  // A light path may turn the axis of a lamp until it is along the tangent.
  constexpr float kLeastAcross = 1e-12F;
  if (!(glm::dot(across, across) > kLeastAcross * glm::dot(tangent, tangent))) {
    across = glm::cross(axis, least_axis(axis));
  }
  const glm::vec3 side = glm::normalize(across);
  return {side, glm::cross(side, axis)};
}

glm::vec3 least_axis(const glm::vec3& v) {
  return std::abs(v.x) < 0.5F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
}

void prepare_profile(const Light& light, PreparedLight& lamp) {
  if (!light.profile) return;
  lamp.profile = light.profile;
  lamp.direction = to_glm(light.direction);
  const auto [side, other_side] = sides_around(lamp.direction, to_glm(light.tangent));
  lamp.side = side;
  lamp.other_side = other_side;
}

UnitLight inverse_square(const PreparedLight& lamp, const glm::vec3& point) {
  const glm::vec3 to_lamp = lamp.position - point;
  const float distance_squared = glm::dot(to_lamp, to_lamp);
  if (!(distance_squared > 0)) return {};
  const float distance = std::sqrt(distance_squared);
  return {to_lamp / distance, distance, lamp.range_window(distance_squared) / distance_squared};
}

// The same operations, so the same bits; in numbers and without branches, so that they are
// vectorised.
void inverse_square(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                    UnitLightBlock& light) {
  const glm::vec3 lamp_position = lamp.position;
  const float reach_squared = lamp.reach_squared;
  const std::size_t begin = part * UnitLightBlock::kPart;
#pragma omp simd
  for (std::size_t k = begin; k < begin + UnitLightBlock::kPart; ++k) {
    const PathFromPoint path(lamp_position, points, k);
    const float distance_squared = path.squared();
    const auto outside = static_cast<float>(distance_squared > 0);
    const float divisor = distance_squared + (1 - outside);
    const float distance = std::sqrt(divisor);
    const float ratio_squared = distance_squared / reach_squared;
    const float window = std::max(0.0F, 1 - ratio_squared * ratio_squared);
    light.direction[0][k] = path.x / distance;
    light.direction[1][k] = path.y / distance;
    light.direction[2][k] = path.z / distance;
    light.distance[k] = outside * distance;
    light.illuminance[k] = outside * window / divisor;
  }
}

void apply_profile(const PreparedLight& lamp, UnitLight& light) {
  if (!lamp.profile || !(light.illuminance > 0)) return;
  const glm::vec3 way = -light.direction;
  const float vertical = std::acos(std::clamp(glm::dot(way, lamp.direction), -1.0F, 1.0F));
  const float horizontal = std::atan2(glm::dot(way, lamp.other_side), glm::dot(way, lamp.side));
  light.illuminance *= lamp.profile->intensity(vertical, horizontal);
}

void apply_profile(const PreparedLight& lamp, std::size_t part, UnitLightBlock& light) {
  if (!lamp.profile) return;
  const std::size_t begin = part * UnitLightBlock::kPart;
  for (std::size_t k = begin; k < begin + UnitLightBlock::kPart; ++k) {
    UnitLight here = light.at(k);
    apply_profile(lamp, here);
    light.illuminance[k] = here.illuminance;
  }
}

glm::vec2 golden_turn(std::uint32_t k) {
  constexpr float kGoldenAngle = 2.39996323F;
  const float turn = kGoldenAngle * static_cast<float>(k);
  return {std::cos(turn), std::sin(turn)};
}

UnitLight from_flat_place(const PreparedLight& lamp, const glm::vec3& to_center, float area,
                          const glm::vec2& at) {
  const glm::vec3 path = to_center + at.x * lamp.side + at.y * lamp.other_side;
  const float distance_squared = glm::dot(path, path);
  if (!(distance_squared > 0)) return {};
  const float distance = std::sqrt(distance_squared);
  const glm::vec3 direction = path / distance;
  const float cosine = std::max(0.0F, -glm::dot(direction, lamp.direction));
  return {direction, distance, area * cosine / distance_squared};
}

void flat_places(const PreparedLight& lamp, const PatchPointBlock& points, std::size_t part,
                 const PartValues& x, const PartValues& y, PlacesOfPart& places) {
  const glm::vec3 middle = lamp.position, side = lamp.side, other_side = lamp.other_side;
  const glm::vec3 direction = lamp.direction;
  const std::size_t begin = part * UnitLightBlock::kPart;
#pragma omp simd
  for (std::size_t e = 0; e < UnitLightBlock::kPart; ++e) {
    const std::size_t k = begin + e;
    PathFromPoint path(middle, points, k);
    path.x = path.x + x[e] * side.x + y[e] * other_side.x;
    path.y = path.y + x[e] * side.y + y[e] * other_side.y;
    path.z = path.z + x[e] * side.z + y[e] * other_side.z;
    const float distance_squared = path.squared();
    places.path[0][e] = path.x;
    places.path[1][e] = path.y;
    places.path[2][e] = path.z;
    places.weight[e] = std::max(0.0F, -path.along(direction)) *
                       std::max(0.0F, path.height(points, k)) /
                       std::max(distance_squared * distance_squared, kLeastDivisor);
  }
}

glm::vec3 from_middle(const PreparedLight& lamp, const glm::vec2& at) {
  return at.x * lamp.side - at.y * lamp.other_side;
}

LampMesh flat_mesh(const PreparedLight& lamp, std::span<const glm::vec2> rim) {
  LampMesh mesh;
  mesh.position.push_back(to_float3(lamp.position));
  for (const glm::vec2& at : rim) {
    mesh.position.push_back(to_float3(lamp.position + at.x * lamp.side - at.y * lamp.other_side));
  }
  mesh.normal.assign(mesh.position.size(), to_float3(lamp.direction));
  const auto count = static_cast<std::uint32_t>(rim.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    mesh.triangle.push_back({0, 1 + k, 1 + (k + 1) % count});
  }
  return mesh;
}

const char kFlatGlsl[] = R"(
float edge_integral(vec3 a, vec3 b, vec3 normal) {
  vec3 axis = cross(a, b);
  float sine = length(axis);
  return sine > 0 ? atan(sine, dot(a, b)) * dot(axis, normal) / sine : 0.0;
}

// Corner k of a regular lamp, seen from the receiver. Those of a disc are outside of it by what
// makes the areas equal.
vec3 flat_corner(int k, int corners, vec3 to_center) {
  float step = 2 * kPi / float(corners), angle = (float(k) + 0.5) * step;
  float reach = corners == 4 ? sqrt(2.0) : sqrt(step / sin(step));
  return to_center + reach * (cos(angle) * lamp_side - sin(angle) * lamp_other_side);
}

// Lambert's formula, cut at the horizon.
float flat_irradiance(vec3 to_center, vec3 normal, int corners) {
  if (dot(to_center, lamp_direction) >= 0) return 0.0;  // from behind
  float sum = 0;
  bool cut = false;
  vec3 rises = vec3(0), sets = vec3(0);
  vec3 a = flat_corner(corners - 1, corners, to_center);
  for (int k = 0; k < corners; ++k) {
    vec3 b = flat_corner(k, corners, to_center);
    float height_a = dot(a, normal), height_b = dot(b, normal);
    vec3 horizon = mix(a, b, height_a / (height_a - height_b));
    if (height_a >= 0 && height_b >= 0) sum += edge_integral(a, b, normal);
    if (height_a < 0 && height_b >= 0) {
      rises = horizon;
      sum += edge_integral(rises, b, normal);
    }
    if (height_a >= 0 && height_b < 0) {
      sets = horizon;
      sum += edge_integral(a, sets, normal);
      cut = true;
    }
    a = b;
  }
  if (cut) sum += edge_integral(sets, rises, normal);
  return kPi * clamp(abs(sum) / (2 * kPi), 0.0, 1.0);
}
)";

}  // namespace rebounce
