#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// The lit sides of display triangles; each belongs to one patch.
struct Elements {
  std::vector<Float3> position;         ///< [p] metres; no two are the same
  std::vector<std::uint32_t> triangle;  ///< [e] surface triangle of the side
  std::vector<Uint3> corner;            ///< [e] positions
  std::vector<Float3> normal;           ///< [e] unit
  std::vector<float> area;              ///< [e] m² of what stops light, > 0
  std::vector<Float3> reflectance;      ///< [e] [0, 1]
  std::vector<std::uint8_t> emits;      ///< [e] 1 if it emits
  std::vector<float> density_weight;    ///< [e] (0, 1] factor of its area
  std::vector<float> lamp_light;        ///< [e] >= 0: LampLight::feature
  std::vector<float> covered;           ///< [e] fraction of its area that is covered closely

  std::size_t size() const { return area.size(); }
  void resize(std::size_t count);

  Float3 centroid(std::size_t e) const;
  glm::vec3 low(std::size_t e) const;  ///< corners of the box around an element
  glm::vec3 high(std::size_t e) const;
};

}  // namespace rebounce
