#pragma once

#include <span>

#include "rebounce/outputs.h"
#include "rebounce/scene_data.h"
#include "rebounce/sky.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes the light that arrives at each patch [n] from patches of `radiosity` [n] in lx and from
/// `sky`: by its cells where the harmonics know them, else by its mean. It has no light of lamps.
/// Neither allocates nor locks; the same bits for any `scheduler`. Throws Error if a size is wrong.
void apply_surface_harmonics(const SurfaceHarmonics& harmonics, std::span<const Float3> radiosity,
                             const Sky& sky, std::span<SurfaceLight> light,
                             const Scheduler& scheduler = {});

/// Writes at each vertex [v] of `mesh` the light that its reconstruction weights give to
/// `patch_light` [n], as reconstruct_at_vertices does for single values.
void reconstruct_at_vertices(const DisplayMesh& mesh, std::span<const SurfaceLight> patch_light,
                             std::span<SurfaceLight> vertex_light, const Scheduler& scheduler = {});

}  // namespace rebounce
