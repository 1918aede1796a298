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
  std::optional<float> exposure;  ///< stops; unset: what a picture of the scene would take
  /// Triangles without texels in the lightmap are cut, all alike, as finely as stays below this
  /// number: finer shadows, larger files. The display mesh is the least there is.
  std::size_t triangle_target = 100000;
  int samples_per_vertex = 16;  ///< points around a vertex where lamps are looked at; at least 1
  int emitter_samples = 64;     ///< as in PictureSettings
};

/// A mesh whose vertices, or the texels of a texture, carry the light that leaves them.
struct LitMesh {
  /// Triangles and vertices of one material.
  struct Part {
    std::uint32_t material = 0;
    bool is_in_texture = false;                      ///< its light is in `texture`, not in `color`
    std::uint32_t index_begin = 0, index_end = 0;    ///< in `index`, three for each triangle
    std::uint32_t vertex_begin = 0, vertex_end = 0;  ///< never empty
  };

  std::vector<Float3> position;  ///< [v] metres
  std::vector<Float2> texcoord;  ///< [v] of the base colour's texture, or of `texture`
  /// [v] linear, ready for the screen, each in [0, 1]. Where the material has a base colour texture
  /// that is to be multiplied with it still.
  std::vector<Float3> color;
  std::vector<std::uint32_t> index;  ///< counts from the part's vertex_begin
  std::vector<Part> part;            ///< at least one
  float exposure = 0;                ///< stops that were used
  /// Of the size of the lightmap: what leaves the parts that have texels, base colour and all.
  /// Empty if none has.
  ScreenImage texture;
};

/// Finds the light that leaves every vertex: direct light as the mean over the surface around it,
/// bounced light as the patches give it, emission. It is scaled by the exposure and taken through
/// the tone curve of pictures, all but the base colour's texture.
///
/// Where data.lightmap has texels for what is opaque, the same is found for the texels, base
/// colour's texture included, and the triangles are left uncut.
///
/// `camera` is where the exposure is measured from. Samples inside solid bodies, as below a box
/// that stands on a floor, do not count. The same bits for any number of OpenMP threads. Throws
/// Error if a texture cannot be decoded or a setting cannot be used.
LitMesh light_mesh(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                   const Camera& camera, const LitMeshSettings& settings = {});

}  // namespace rebounce
