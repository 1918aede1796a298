#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "transfer/base/types.h"

namespace rebounce {

/// The lit sides of display triangles, each an element of some patch.
struct Elements {
  std::vector<Float3> position;         ///< [p] metres; no two are the same
  std::vector<std::uint32_t> triangle;  ///< [e] that of the surface which it is a side of
  std::vector<Uint3> corner;            ///< [e] positions
  std::vector<Float3> normal;           ///< [e] unit
  std::vector<float> area;              ///< [e] m² of what stops light, > 0
  std::vector<Float3> reflectance;      ///< [e] [0, 1]
  std::vector<std::uint8_t> emits;      ///< [e] 1 if it does
  std::vector<float> density_weight;    ///< [e] (0, 1] what its area counts for
  std::vector<float> covered;           ///< [e] part of it above which something lies close

  std::size_t size() const { return area.size(); }
  void resize(std::size_t count);

  Float3 centroid(std::size_t e) const;
  glm::vec3 low(std::size_t e) const;  ///< of the box around it
  glm::vec3 high(std::size_t e) const;
};

}  // namespace rebounce
