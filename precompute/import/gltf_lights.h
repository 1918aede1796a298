#pragma once

#include <span>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_nodes.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// Adds the lights (KHR_lights_punctual) and perspective cameras of `nodes` to `scene`, placed in
/// the world. What cannot be used (an unknown type, a negative intensity, an orthographic camera, a
/// node scaled to nothing) is left out with a warning. `scale` turns the asset's unit into metres:
/// `nodes` have it already, the lights' ranges get it here; intensities are photometric and stay.
void import_lights_and_cameras(const Document& document, std::span<const PlacedNode> nodes,
                               double scale, Scene& scene, Warnings& warnings);

}  // namespace rebounce::gltf
