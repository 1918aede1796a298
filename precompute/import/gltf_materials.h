#pragma once

#include <vector>

#include "precompute/import/gltf_document.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// The texture coordinates that a texture uses, and their KHR_texture_transform.
struct TexcoordSource {
  bool used = false;  ///< false if the material has no such texture
  int set = 0;        ///< n of TEXCOORD_n
  Float2 offset{0, 0};
  Float2 scale{1, 1};
  double rotation = 0;  ///< radians

  /// The coordinate at which the texture is sampled.
  Float2 transformed(Float2 texcoord) const;
};

/// The texture coordinates that the primitives of a material need.
struct MaterialTexcoords {
  TexcoordSource base_color;
  TexcoordSource emissive;
  bool uses_alpha = false;  ///< the material is not opaque
};

/// Adds the materials of the asset to `scene`, in order, then the default material of glTF; and
/// their textures, decoded. Returns one entry for each material of `scene`.
std::vector<MaterialTexcoords> import_materials(const Document& document, Scene& scene,
                                                Warnings& warnings);

}  // namespace rebounce::gltf
