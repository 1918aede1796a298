#pragma once

#include <vector>

#include "rebounce/types.h"

namespace rebounce {

/// The surface of a lamp as triangles, counter-clockwise seen from the side that shines.
struct LampMesh {
  std::vector<Float3> position, normal;  ///< [v] metres in the world; unit
  std::vector<Uint3> triangle;
};

/// The unit sphere around the origin, in circles of latitude.
const LampMesh& unit_sphere();

}  // namespace rebounce
