#pragma once

#include <span>

#include "rebounce/scene_data.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes at each vertex of `mesh` [v] the value that its reconstruction weights give to
/// `patch_value` [n], indirect irradiance for instance; 0 at vertices without weights. Neither
/// allocates nor locks; the same bits for any `scheduler`. Throws Error if the result has another
/// size; patch_value must have an entry for each patch of the mesh.
void reconstruct_at_vertices(const DisplayMesh& mesh, std::span<const Float3> patch_value,
                             std::span<Float3> vertex_value, const Scheduler& scheduler = {});

/// The same, at least 0: weights may be negative.
void light_at_vertices(const DisplayMesh& mesh, std::span<const Float3> patch_light,
                       std::span<Float3> vertex_light, const Scheduler& scheduler = {});

/// Makes all values at least 0.
void clamp_light(std::span<Float3> light, const Scheduler& scheduler = {});

}  // namespace rebounce
