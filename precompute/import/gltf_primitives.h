#pragma once

#include <span>
#include <string>
#include <vector>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_materials.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// More than can be precomputed; a small file could otherwise fill the memory by using a mesh
/// often.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 26;

/// Adds `more` triangles to `total`, or throws Error where that makes more than kMaxTriangles.
void add_triangles(std::size_t& total, std::size_t more);

/// A primitive's triangles in its mesh's own space, checked.
struct Primitive {
  std::string place;                        ///< for messages: meshes[2] "Chair", primitives[0]
  std::string mesh_name;                    ///< likewise: meshes[2] "Chair"
  std::uint32_t material = 0;               ///< in Scene::materials
  std::vector<Float3> position;             ///< [v] finite
  std::vector<Float3> normal;               ///< [v] as stored; empty where the asset has none
  std::vector<Float2> base_color_texcoord;  ///< [v] finite
  std::vector<Float2> emissive_texcoord;    ///< [v] finite
  std::vector<Float2> lightmap_texcoord;    ///< [v] finite; empty where the asset has none
  std::vector<Float3> vertex_color;         ///< [v] finite, >= 0
  std::vector<Uint3> triangle;              ///< indices in range
};

/// Reads the triangle primitives of a mesh (an index in range); points and lines are skipped and
/// counted. Throws Error, which names mesh and primitive, for what cannot be trusted.
std::vector<Primitive> read_primitives(const Document& document, std::size_t mesh,
                                       std::span<const MaterialTexcoords> texcoords,
                                       Warnings& warnings);

}  // namespace rebounce::gltf
