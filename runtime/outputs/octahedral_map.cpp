// Normals for irradiance maps.

#include <cmath>

#include "rebounce/outputs.h"
#include "transfer/base/argument_check.h"

namespace rebounce {
namespace {

/// The direction at (u, v), each in [-1, 1], of an octahedral map of the sphere, with +z at the
/// centre and -z at the corners (Z. Cigolle et al., "A survey of efficient representations for
/// independent unit vectors", JCGT 3(2), 2014).
Float3 octahedral_direction(float u, float v) {
  Float3 d = {u, v, 1 - std::abs(u) - std::abs(v)};
  if (d[2] < 0) {
    d[0] = std::copysign(1 - std::abs(v), u);
    d[1] = std::copysign(1 - std::abs(u), v);
  }
  const float length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (float& x : d) x /= length;
  return d;
}

}  // namespace

void write_octahedral_normals(std::size_t size, std::span<Float3> normals) {
  check_size("octahedral map: the normals", normals.size(), size * size);
  const auto at = [&](std::size_t k) {
    return (2 * static_cast<float>(k) + 1) / static_cast<float>(size) - 1;
  };
  for (std::size_t k = 0; k < normals.size(); ++k) {
    normals[k] = octahedral_direction(at(k % size), at(k / size));
  }
}

}  // namespace rebounce
