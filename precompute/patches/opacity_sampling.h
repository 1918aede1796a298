#pragma once

#include <span>

#include "precompute/import/scene.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {

/// Finds the opacity map of every triangle that light passes through in part, from the textures of
/// `scene`: the part that opacity_at() of its material stops, less what is transmitted. A material
/// that emits transmits nothing: its light would leave with what passes.
///
/// `triangle` [t] indexes `texcoord`, those of the base colour; `triangle_material` [t]. A map has
/// about one micro-triangle for four texels, 1,024 at most, and no more than it needs; maps that
/// are equal are one. The same for any number of threads.
OpacityMaps find_opacity_maps(const Scene& scene, std::span<const Uint3> triangle,
                              std::span<const std::uint32_t> triangle_material,
                              std::span<const Float2> texcoord);

/// The same of the scene's own triangles.
OpacityMaps find_opacity_maps(const Scene& scene);

}  // namespace rebounce
