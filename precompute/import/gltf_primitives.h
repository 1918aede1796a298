#pragma once

#include <span>
#include <string>
#include <vector>

#include "precompute/import/gltf_document.h"
#include "precompute/import/gltf_materials.h"
#include "precompute/import/scene.h"

namespace rebounce::gltf {

/// The limit of triangles, more than a build can handle: a small file could fill the memory by
/// using a mesh often.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 26;

/// Adds `more` triangles to `total`. Throws Error if the sum exceeds kMaxTriangles.
void add_triangles(std::size_t& total, std::size_t more);

/// The checked triangles of a primitive, in the space of its mesh.
struct Primitive {
  std::string place;                        ///< for messages: meshes[2] "Chair", primitives[0]
  std::string mesh_name;                    ///< for messages: meshes[2] "Chair"
  std::uint32_t material = 0;               ///< index in Scene::materials
  std::vector<Float3> position;             ///< [v] finite
  std::vector<Float3> normal;               ///< [v] as stored; empty if the asset has none
  std::vector<Float2> base_color_texcoord;  ///< [v] finite
  std::vector<Float2> emissive_texcoord;    ///< [v] finite
  std::vector<Float2> lightmap_texcoord;    ///< [v] finite; empty if the asset has none
  std::vector<Float3> vertex_color;         ///< [v] finite, >= 0
  std::vector<Uint3> triangle;              ///< indices in range
};

/// Reads the triangle primitives of a mesh (an index in range); points and lines are skipped and
/// counted. Throws Error, which names mesh and primitive, for invalid data.
std::vector<Primitive> read_primitives(const Document& document, std::size_t mesh,
                                       std::span<const MaterialTexcoords> texcoords,
                                       Warnings& warnings);

}  // namespace rebounce::gltf
