#include "body_mesh.h"

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "rebounce/runtime/float3_glm.h"
#include "sample_sequence.h"

namespace rebounce {
namespace {

constexpr int kLongitudes = 96, kLatitudes = 48;
constexpr int kRim = 96;  // corners of a disc
constexpr float kGoldenAngle = 2.39996323F;
constexpr float kPi = std::numbers::pi_v<float>;

std::uint32_t next_vertex(const BodyMesh& mesh) {
  return static_cast<std::uint32_t>(mesh.vertex.size());
}

Float3 direction_at(int longitude, int latitude) {
  const float theta = kPi * static_cast<float>(latitude) / kLatitudes;
  const float phi = 2 * kPi * static_cast<float>(longitude) / kLongitudes;
  return {std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)};
}

/// A fan around a middle, counter-clockwise seen from where `normal` points to.
void add_fan(const glm::vec3& middle, const Float3& normal, const std::vector<glm::vec3>& rim,
             BodyMesh& mesh) {
  const std::uint32_t first = next_vertex(mesh);
  mesh.vertex.push_back({.position = to_float3(middle), .normal = normal});
  for (const glm::vec3& place : rim) {
    mesh.vertex.push_back({.position = to_float3(place), .normal = normal});
  }
  const auto count = static_cast<std::uint32_t>(rim.size());
  for (std::uint32_t k = 0; k < count; ++k) {
    mesh.triangle.push_back({first, first + 1 + k, first + 1 + (k + 1) % count});
  }
}

void add_flat_lamp(const Light& lamp, BodyMesh& mesh) {
  const auto axes = flat_lamp_axes(lamp);
  const glm::vec3 side = to_glm(axes[0]), other = to_glm(axes[1]), middle = to_glm(lamp.position);
  std::vector<glm::vec3> rim;
  if (lamp.type == LightType::kRectangle) {
    rim = {middle - side - other, middle + side - other, middle + side + other,
           middle - side + other};
  } else {
    for (int k = 0; k < kRim; ++k) {
      const float angle = 2 * kPi * static_cast<float>(k) / kRim;
      rim.push_back(middle + std::cos(angle) * side + std::sin(angle) * other);
    }
  }
  add_fan(middle, lamp.direction, rim, mesh);
}

}  // namespace

std::array<Float3, 2> flat_lamp_axes(const Light& lamp) {
  const glm::vec3 axis = to_glm(lamp.direction);
  const bool round = lamp.type == LightType::kDisc;
  const glm::vec3 any = std::abs(axis.x) < 0.5F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 tangent = round ? any : to_glm(lamp.tangent);
  const glm::vec3 side = glm::normalize(tangent - glm::dot(tangent, axis) * axis);
  // Counter-clockwise around the axis.
  const glm::vec3 other_side = glm::cross(axis, side);
  return {to_float3(side * (round ? lamp.radius : 0.5F * lamp.size[0])),
          to_float3(other_side * (round ? lamp.radius : 0.5F * lamp.size[1]))};
}

std::array<glm::vec3, kLampPlaceCount> places_on_lamp(const Light& lamp) {
  std::array<glm::vec3, kLampPlaceCount> places;
  const bool ball = lamp.type == LightType::kSphere;
  const auto axes = ball ? std::array<Float3, 2>{} : flat_lamp_axes(lamp);
  for (std::uint32_t k = 0; k < kLampPlaceCount; ++k) {
    const float part = (static_cast<float>(k) + 0.5F) / kLampPlaceCount;
    const float turn = kGoldenAngle * static_cast<float>(k);
    const glm::vec2 around(std::cos(turn), std::sin(turn));
    if (ball) {
      const float height = 1 - 2 * part, r = std::sqrt(1 - height * height);
      places[k] = lamp.radius * glm::vec3(r * around.x, height, r * around.y);
      continue;
    }
    const glm::vec2 at = lamp.type == LightType::kDisc ? std::sqrt(part) * around
                                                       : 2.0F * r2_point(k, glm::vec2(0.5F)) - 1.0F;
    places[k] = at.x * to_glm(axes[0]) + at.y * to_glm(axes[1]);
  }
  return places;
}

float area_of_lamp(const Light& lamp) {
  if (lamp.type == LightType::kRectangle) return lamp.size[0] * lamp.size[1];
  const float disc = kPi * lamp.radius * lamp.radius;
  return lamp.type == LightType::kSphere ? 4 * disc : disc;
}

const std::vector<Float3>& sphere_normals() {
  static const std::vector<Float3> normals = [] {
    std::vector<Float3> made;
    for (int j = 0; j <= kLatitudes; ++j) {
      for (int i = 0; i <= kLongitudes; ++i) made.push_back(direction_at(i, j));
    }
    return made;
  }();
  return normals;
}

void add_sphere(const Float3& center, float radius,
                const std::function<BodyVertex(std::size_t k)>& shade, BodyMesh& mesh) {
  BodyPart part{.begin = static_cast<std::uint32_t>(mesh.triangle.size())};
  const std::uint32_t first = next_vertex(mesh);
  const std::vector<Float3>& normals = sphere_normals();
  for (std::size_t k = 0; k < normals.size(); ++k) {
    BodyVertex vertex = shade(k);
    vertex.position = to_float3(to_glm(center) + radius * to_glm(normals[k]));
    vertex.normal = normals[k];
    mesh.vertex.push_back(vertex);
  }
  for (std::uint32_t j = 0; j < kLatitudes; ++j) {
    for (std::uint32_t i = 0; i < kLongitudes; ++i) {
      const std::uint32_t a = first + j * (kLongitudes + 1) + i, b = a + kLongitudes + 1;
      if (j > 0) mesh.triangle.push_back({a, b, a + 1});
      if (j + 1 < kLatitudes) mesh.triangle.push_back({b, b + 1, a + 1});
    }
  }
  part.end = static_cast<std::uint32_t>(mesh.triangle.size());
  mesh.part.push_back(part);
}

void add_lamp_surface(const Light& lamp, BodyMesh& mesh) {
  const auto begin = static_cast<std::uint32_t>(mesh.triangle.size());
  if (lamp.type == LightType::kSphere) {
    add_sphere(
        lamp.position, lamp.radius, [](std::size_t) { return BodyVertex{}; }, mesh);
    mesh.part.pop_back();
  } else if (lamp.type == LightType::kRectangle || lamp.type == LightType::kDisc) {
    add_flat_lamp(lamp, mesh);
  } else {
    return;
  }
  mesh.part.push_back({.begin = begin,
                       .end = static_cast<std::uint32_t>(mesh.triangle.size()),
                       .emitted_luminance = to_float3(lamp.intensity * to_glm(lamp.color))});
}

}  // namespace rebounce
