#pragma once

// Which patch's light a ray meets.

#include <cstdint>
#include <span>
#include <vector>

#include "rebounce/precompute/lit_sides.h"
#include "rebounce/runtime/ray_tracer.h"
#include "rebounce/transfer/transfer_data.h"

namespace rebounce {

/// True for a ray that ends at the back of a one-sided surface.
bool meets_back(const DisplayMesh& mesh, const Hit& hit);

/// The patch whose light shows where `hit` is; kNone if none does or nothing was hit. `shown_patch`
/// is that of PatchModel.
std::uint32_t patch_at(const DisplayMesh& mesh, std::span<const std::uint32_t> shown_patch,
                       const Hit& hit);

/// Room for the work of prefer_lit_side.
struct CoincidenceScratch {
  std::vector<Hit> hits;
  std::vector<CoincidentSide> sides;
};

/// Of surfaces that lie in one another (copies, or two that make up a sheet) a ray may meet any. If
/// `hit` of `ray` is a side without a patch of its own, in whose place another one has one and
/// faces the same way, makes that one the side that was hit; the weights of the vertices are left.
/// Else, and where nothing was hit, leaves `hit` as it is.
void prefer_lit_side(const DisplayMesh& mesh, const RayTracer& tracer, const Ray& ray, Hit& hit,
                     CoincidenceScratch& scratch);

}  // namespace rebounce
