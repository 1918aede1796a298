#pragma once

#include <span>

#include "rebounce/types.h"

namespace rebounce {

/// How far from its surface a ray begins, so that it does not hit it: 2^-18 of the largest
/// coordinate of `position`, in metres. A ray's origin, its end and the plane equation each have
/// rounding errors of about 2^-24 of the scene's largest coordinates, even near the origin of
/// space. The offset is a few tens of such errors: 40 micrometres in a room of ten metres.
float ray_offset_distance(std::span<const Float3> position);

/// `point` moved by `distance` along the unit `normal`.
inline Float3 offset_along(const Float3& point, const Float3& normal, float distance) {
  Float3 moved;
  for (int axis = 0; axis < 3; ++axis) {
    moved[axis] = point[axis] + distance * normal[axis];
  }
  return moved;
}

}  // namespace rebounce
