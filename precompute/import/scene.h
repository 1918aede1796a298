#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "transfer/base/types.h"
#include "transfer/data/scene_description.h"

namespace rebounce {

/// A decoded image: 8-bit sRGB, alpha last, rows from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< [height][width][4]
};

/// A vertex's place in the lightmap that its asset was unwrapped for.
struct LightmapTexcoord {
  Float2 texcoord{0, 0};       ///< TEXCOORD_1: (0, 0) is the upper left corner of the page
  std::uint32_t page = kNone;  ///< the placed mesh whose page that is; kNone: none
};

/// A mesh where a node places it.
struct PlacedMesh {
  std::string mesh_name, node_name;  ///< as the asset has them, either may be empty
};

/// A static triangle scene in world space: metres, right-handed, +Y up.
struct Scene {
  std::vector<Float3> position;             ///< [v]
  std::vector<Float3> normal;               ///< [v] unit, on the front side
  std::vector<Float2> base_color_texcoord;  ///< [v] set and KHR_texture_transform applied
  std::vector<Float2> emissive_texcoord;    ///< [v] likewise
  std::vector<Float3> vertex_color;         ///< [v] linear, 1 where the asset has none
  /// [v] finite, or empty where no mesh has a second set of texture coordinates. Every mesh has a
  /// page of its own wherever it is placed.
  std::vector<LightmapTexcoord> lightmap_texcoord;
  std::vector<std::string> lightmap_page;  ///< name of each page's mesh, for messages

  std::vector<Uint3> triangle;  ///< [t] counter-clockwise seen from the front (mirrors undone)
  std::vector<std::uint32_t> triangle_material;  ///< [t]
  std::vector<std::uint32_t> triangle_mesh;      ///< [t] in placed_meshes, or empty: unknown
  std::vector<PlacedMesh> placed_meshes;

  std::vector<Material> materials;  ///< at least one
  std::vector<Texture> textures;
  std::vector<Image> images;  ///< decoded, one for each texture
  std::vector<Light> lights;
  std::vector<Camera> cameras;

  std::string name;  ///< file name without its folder
  std::string hash;  ///< "xxh3:" + 32 hexadecimal digits over the file, its buffers and images
  std::size_t degenerate_triangle_count = 0;  ///< dropped: no area
  std::vector<std::string> warnings;          ///< one line each
};

}  // namespace rebounce
