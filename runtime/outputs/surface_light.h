#pragma once

#include <array>
#include <span>

#include "transfer/base/parallel.h"
#include "transfer/data/scene_description.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Radiance that arrives at a surface, cd/m²: coefficients of spherical harmonics of degree 0 and
/// 1, each of three channels.
using SurfaceLight = std::array<Float3, kLinearHarmonicCount>;

/// Writes the light that arrives at each patch [n] from patches of `radiosity` [n] in lx and from
/// `sky`, by its cells where the harmonics know them, else as its mean; that of lamps is not in it.
/// Neither allocates nor locks; the same bits for any `scheduler`. Throws Error if a size is wrong.
void apply_surface_harmonics(const SurfaceHarmonics& harmonics, std::span<const Float3> radiosity,
                             const Sky& sky, std::span<SurfaceLight> light,
                             const Scheduler& scheduler = {});

/// Writes at each vertex [v] of `mesh` the light that its reconstruction weights give to
/// `patch_light` [n], as reconstruct_at_vertices does for single values.
void reconstruct_at_vertices(const DisplayMesh& mesh, std::span<const SurfaceLight> patch_light,
                             std::span<SurfaceLight> vertex_light, const Scheduler& scheduler = {});

/// The irradiance in lx on a surface with unit `normal` of the light alone, at least 0.
Float3 surface_irradiance(const SurfaceLight& light, const Float3& normal);

/// What `irradiance`, in lx on a surface with unit `normal`, is where a normal map bends that to
/// the unit vector `bent`: scaled by what the light says of both. `normal` itself leaves it as it
/// is, so that the operator's irradiance, which is exact, stays what flat surfaces show.
Float3 bent_irradiance(const SurfaceLight& light, const Float3& irradiance, const Float3& normal,
                       const Float3& bent);

}  // namespace rebounce
