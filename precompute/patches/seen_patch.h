#pragma once

// Which patch's light a ray meets.

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

/// The patch whose light shows where `hit` is; kNone if none does or nothing was hit. `shown_patch`
/// is that of PatchModel.
inline std::uint32_t patch_at(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                              const Hit& hit) {
  if (hit.triangle == kNone || meets_back(mesh, hit)) return kNone;
  return shown_patch[hit.front ? hit.triangle : mesh.back_triangle[hit.triangle]];
}

/// Room for the work of prefer_lit_side.
struct CoincidenceScratch {
  std::vector<Hit> hits;
  std::vector<CoincidentSide> sides;
};

/// The rest of prefer_lit_side, for hits of a side without a patch.
void find_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray, Hit& hit,
                   CoincidenceScratch& scratch);

/// Of surfaces that lie in one another (copies, or two that make up a sheet) a ray may meet any. If
/// `hit` of `ray` is a side without a patch of its own, in whose place another one has one and
/// faces the same way, makes that one the side that was hit; the weights of the vertices are left.
/// Else, and where nothing was hit, leaves `hit` as it is.
inline void prefer_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray,
                            Hit& hit, CoincidenceScratch& scratch) {
  if (hit.triangle == kNone || patch_at(mesh, mesh.triangle_patch, hit) != kNone) return;
  find_lit_side(mesh, tracer, ray, hit, scratch);
}

}  // namespace rebounce
