#pragma once

#include <span>

#include "precompute/import/scene.h"
#include "rebounce/scene_data.h"

namespace rebounce {

/// Finds the opacity map of every triangle that light passes through in part, from the textures of
/// `scene`: the fraction that opacity_at() of its material stops, minus the transmitted fraction. A
/// material that emits transmits nothing: otherwise its light would leave with the light that
/// passes.
///
/// `triangle` [t] indexes `texcoord`, the coordinates of the base colour; `triangle_material` is
/// [t]. A map has about one micro-triangle for four texels, at most 1,024, and no more than it
/// needs; equal maps are stored once. The result is the same for any number of threads.
OpacityMaps find_opacity_maps(const Scene& scene, std::span<const Uint3> triangle,
                              std::span<const std::uint32_t> triangle_material,
                              std::span<const Float2> texcoord);

/// The same for the triangles of the scene itself.
OpacityMaps find_opacity_maps(const Scene& scene);

}  // namespace rebounce
