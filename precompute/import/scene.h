#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rebounce/scene_data.h"
#include "rebounce/types.h"
#include "runtime/images/coded_image.h"

namespace rebounce {

/// A decoded image, in sRGB.
using Image = RgbaImage;

/// The place of a vertex in the lightmap that its asset is unwrapped for.
struct LightmapTexcoord {
  Float2 texcoord{0, 0};       ///< TEXCOORD_1: (0, 0) is the upper left corner of the page
  std::uint32_t page = kNone;  ///< index of the placed mesh that has the page; kNone: no place
};

/// A mesh and the node that places it.
struct PlacedMesh {
  std::string mesh_name, node_name;  ///< as in the asset; either may be empty
};

/// A static triangle scene in world space: metres, right-handed, +Y up.
struct Scene {
  std::vector<Float3> position;  ///< [v]
  std::vector<Float3> normal;    ///< [v] unit, on the front side
  /// [v] after choice of the set and KHR_texture_transform.
  std::vector<Float2> base_color_texcoord;
  std::vector<Float2> emissive_texcoord;  ///< [v] in the same way
  std::vector<Float3> vertex_color;       ///< [v] linear, 1 if the asset has none
  /// [v] finite, or empty if no mesh has a second set of texture coordinates. Every placement of a
  /// mesh has a page of its own.
  std::vector<LightmapTexcoord> lightmap_texcoord;
  std::vector<std::string> lightmap_page;  ///< name of the mesh of each page, for messages

  std::vector<Uint3> triangle;  ///< [t] counter-clockwise seen from the front (mirroring is undone)
  std::vector<std::uint32_t> triangle_material;  ///< [t]
  std::vector<std::uint32_t> triangle_mesh;      ///< [t] in placed_meshes, or empty: unknown
  std::vector<PlacedMesh> placed_meshes;

  std::vector<Material> materials;  ///< at least one
  std::vector<Texture> textures;
  std::vector<Image> images;  ///< decoded, one for each texture
  std::vector<Light> lights;
  std::vector<Camera> cameras;

  std::string name;  ///< file name without its folder
  double scale = 1;  ///< metres in one unit of the file
  std::string hash;  ///< "xxh3:" + 32 hexadecimal digits over the file, its buffers and images
  std::size_t degenerate_triangle_count = 0;  ///< triangles without area, dropped
  std::vector<std::string> warnings;          ///< one line each
};

}  // namespace rebounce
