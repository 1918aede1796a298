#pragma once

#include <span>

#include "rebounce/scene_data.h"
#include "transfer/base/parallel.h"

namespace rebounce {

/// Writes at each texel [height][width] of `lightmap` the value at its place on `mesh`, from values
/// at the vertices [v] (reconstruct_at_vertices); 0 where it has none. Neither allocates nor locks;
/// the same bits for any `scheduler`. Throws Error if a size is wrong.
void interpolate_at_texels(const Lightmap& lightmap, const DisplayMesh& mesh,
                           std::span<const Float3> vertex_value, std::span<Float3> texel_value,
                           const Scheduler& scheduler = {});

/// The same, at least 0: values at vertices may be negative.
void light_at_texels(const Lightmap& lightmap, const DisplayMesh& mesh,
                     std::span<const Float3> vertex_value, std::span<Float3> texel_light,
                     const Scheduler& scheduler = {});

}  // namespace rebounce
