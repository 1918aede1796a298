#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/demo/image/image_file.h"
#include "runtime/demo/picture/picture.h"
#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

struct LitMeshSettings {
  std::optional<float> exposure;  ///< stops; unset: as for a picture of the scene
  /// Triangles without texels in the lightmap are divided, all equally, as finely as this number of
  /// triangles allows. More: finer shadows, larger files. The display mesh is the coarsest result.
  std::size_t triangle_target = 100000;
  int samples_per_vertex = 16;  ///< points around a vertex that lamps light; at least 1
  int emitter_samples = 64;     ///< as in PictureSettings
};

/// A mesh whose vertices, or the texels of a texture, hold the light that leaves them.
struct LitMesh {
  /// The triangles and vertices of one material.
  struct Part {
    std::uint32_t material = 0;
    bool is_in_texture = false;                      ///< its light is in `texture`, not in `color`
    std::uint32_t index_begin = 0, index_end = 0;    ///< in `index`, three for each triangle
    std::uint32_t vertex_begin = 0, vertex_end = 0;  ///< never empty
  };

  std::vector<Float3> position;  ///< [v] metres
  std::vector<Float2> texcoord;  ///< [v] for the base colour texture, or for `texture`
  /// [v] linear screen colour, each channel in [0, 1]. If the material has a base colour texture,
  /// it must still be multiplied with it.
  std::vector<Float3> color;
  std::vector<std::uint32_t> index;  ///< relative to the part's vertex_begin
  std::vector<Part> part;            ///< at least one
  float exposure = 0;                ///< stops
  /// The light that leaves the parts with texels, base colour included, in the size of the
  /// lightmap. Empty if no part has texels.
  ScreenImage texture;
};

/// Computes the light that leaves every vertex: direct light as a mean over the surface around it,
/// indirect light from the patches, and emission. The result is scaled by the exposure and mapped
/// with the tone curve of pictures, without the base colour texture.
///
/// For opaque surface with texels in data.lightmap, the light is computed at the texels instead,
/// base colour texture included, and the triangles are not divided.
///
/// `camera` is used to find the exposure. Samples inside solid bodies, as below a box that stands
/// on a floor, are ignored. Gives the same bits for any number of OpenMP threads. Throws Error if a
/// texture cannot be decoded or a setting is out of range.
LitMesh light_mesh(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                   const Camera& camera, const LitMeshSettings& settings = {});

}  // namespace rebounce
