#pragma once

// The patch that a ray meets.

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/patches/lit_sides.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// True for a ray that ends at the back of a one-sided surface.
inline bool meets_back(const DisplayMesh& mesh, const Hit& hit) {
  return hit.triangle != kNone && !hit.front && mesh.back_triangle[hit.triangle] == kNone;
}

/// The patch whose light shows at `hit`; kNone if there is none or nothing was hit. `shown_patch`
/// is that of PatchModel.
inline std::uint32_t patch_at(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                              const Hit& hit) {
  if (hit.triangle == kNone || meets_back(mesh, hit)) return kNone;
  return shown_patch[hit.front ? hit.triangle : mesh.back_triangle[hit.triangle]];
}

/// Memory of prefer_lit_side.
struct CoincidenceScratch {
  std::vector<Hit> hits;
  std::vector<CoincidentSide> sides;
};

/// The second part of prefer_lit_side, for hits of a side without a patch.
void find_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray, Hit& hit,
                   CoincidenceScratch& scratch);

/// Where surfaces lie in one another (copies, or two that form a sheet) a ray may meet any of them.
/// If `hit` of `ray` is a side without a patch, and another side in the same place has one and
/// faces the same way, the hit becomes that side; its barycentric weights stay. Otherwise, and
/// where nothing was hit, `hit` does not change.
inline void prefer_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray,
                            Hit& hit, CoincidenceScratch& scratch) {
  if (hit.triangle == kNone || patch_at(mesh, mesh.triangle_patch, hit) != kNone) return;
  find_lit_side(mesh, tracer, ray, hit, scratch);
}

}  // namespace rebounce
