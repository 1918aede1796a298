#pragma once

#include <span>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_materials.h"
#include "precompute/import/gltf_nodes.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// Adds the triangles of every mesh that `nodes` place to `scene`, in world space. `texcoords` is
/// the result of import_materials. Throws Error, which names mesh and primitive, for invalid
/// geometry; triangles without area are dropped and counted.
void import_meshes(const Document& document, std::span<const PlacedNode> nodes,
                   std::span<const MaterialTexcoords> texcoords, Scene& scene, Warnings& warnings);

}  // namespace rebounce::gltf
