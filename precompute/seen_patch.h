#pragma once

#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// True for a ray that ends at the back of a one-sided surface.
inline bool meets_back(const DisplayMesh& mesh, const Hit& hit) {
  return hit.triangle != kNone && !hit.front && mesh.back_triangle[hit.triangle] == kNone;
}

/// The patch whose light a ray meets; kNone for one that leaves the scene or meets a back or a side
/// without a patch.
inline std::uint32_t seen_patch(const DisplayMesh& mesh, const Hit& hit) {
  if (hit.triangle == kNone || meets_back(mesh, hit)) return kNone;
  return mesh.triangle_patch[hit.front ? hit.triangle : mesh.back_triangle[hit.triangle]];
}

}  // namespace rebounce
