#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "runtime/rays/float3_glm.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::test {

/// What point lights in a room of 4 x 3 x 5 m give its patches, shadows aside: initial exitances
/// [n]. Their heights are in the middle eight tenths of `height` metres above `floor`.
inline std::vector<std::vector<Float3>> unshadowed_lights(const PatchTable& patches, int count,
                                                          std::uint64_t seed, double floor,
                                                          double height) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> uniform(0.1, 0.9);
  std::vector<std::vector<Float3>> lights;
  for (int k = 0; k < count; ++k) {
    const glm::dvec3 lamp(4 * uniform(engine), floor + height * uniform(engine),
                          5 * uniform(engine));
    std::vector<Float3>& light = lights.emplace_back();
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const glm::dvec3 d = lamp - to_dvec3(patches.centroid[i]);
      const double cosine = std::max(0.0, glm::dot(glm::normalize(d), to_dvec3(patches.normal[i])));
      const auto e = static_cast<float>(cosine / glm::dot(d, d));
      const Float3& rho = patches.reflectance[i];
      light.push_back({e * rho[0], e * rho[1], e * rho[2]});
    }
  }
  return lights;
}

}  // namespace rebounce::test
