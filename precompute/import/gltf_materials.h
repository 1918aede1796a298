#pragma once

#include <vector>

#include "precompute/import/gltf_document.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// Which texture coordinates a texture wants, and what KHR_texture_transform makes of them.
struct TexcoordSource {
  bool used = false;  ///< false: the material has no such texture
  int set = 0;        ///< n of TEXCOORD_n
  Float2 offset{0, 0};
  Float2 scale{1, 1};
  double rotation = 0;  ///< radians

  /// The coordinate that the texture is sampled at.
  Float2 transformed(Float2 texcoord) const;
};

/// How the texture coordinates of a material's primitives are to be made.
struct MaterialTexcoords {
  TexcoordSource base_color;
  TexcoordSource emissive;
  bool uses_alpha = false;  ///< the material is not opaque
};

/// Adds the asset's materials to `scene`, in order, then glTF's default material; and the textures
/// that they use, decoded. Returns one entry for each material of `scene`.
std::vector<MaterialTexcoords> import_materials(const Document& document, Scene& scene,
                                                Warnings& warnings);

}  // namespace rebounce::gltf
