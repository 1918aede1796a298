#pragma once

#include <span>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_nodes.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// Adds the lights (KHR_lights_punctual) and perspective cameras of `nodes` to `scene`, in world
/// space. Lights and cameras that cannot be used (an unknown type, a negative intensity, an
/// orthographic camera, a node scaled to zero) are left out with a warning. `scale` converts the
/// unit of the asset into metres. It applies to the ranges of lights; the transforms of `nodes`
/// contain it, and intensities are photometric and stay.
void import_lights_and_cameras(const Document& document, std::span<const PlacedNode> nodes,
                               double scale, Scene& scene, Warnings& warnings);

}  // namespace rebounce::gltf
