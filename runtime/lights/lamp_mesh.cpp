#include "runtime/lights/lamp_mesh.h"

#include <cmath>
#include <numbers>

namespace rebounce {
namespace {

constexpr int kLongitudes = 96, kLatitudes = 48;

Float3 direction_at(int longitude, int latitude) {
  const float theta = std::numbers::pi_v<float> * static_cast<float>(latitude) / kLatitudes;
  const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(longitude) / kLongitudes;
  return {std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)};
}

LampMesh make_unit_sphere() {
  LampMesh mesh;
  for (int j = 0; j <= kLatitudes; ++j) {
    for (int i = 0; i <= kLongitudes; ++i) mesh.position.push_back(direction_at(i, j));
  }
  mesh.normal = mesh.position;
  for (std::uint32_t j = 0; j < kLatitudes; ++j) {
    for (std::uint32_t i = 0; i < kLongitudes; ++i) {
      const std::uint32_t a = j * (kLongitudes + 1) + i, b = a + kLongitudes + 1;
      if (j > 0) mesh.triangle.push_back({a, b, a + 1});
      if (j + 1 < kLatitudes) mesh.triangle.push_back({b, b + 1, a + 1});
    }
  }
  return mesh;
}

}  // namespace

const LampMesh& unit_sphere() {
  static const LampMesh sphere = make_unit_sphere();
  return sphere;
}

}  // namespace rebounce
