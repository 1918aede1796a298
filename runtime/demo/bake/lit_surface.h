#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "runtime/demo/picture/picture.h"
#include "runtime/demo/shading/direct_light.h"
#include "runtime/demo/shading/display_surface.h"
#include "runtime/demo/shading/emitters.h"
#include "runtime/demo/shading/picture_light.h"

namespace rebounce {

/// A piece of surface to light: that of a vertex or of a texel.
struct LitPiece {
  SurfacePoint point;  ///< at its centre
  float width = 0;     ///< metres
  Float3 added{};      ///< to the bounced light of its vertices, lx
};

/// Computes the light that leaves pieces of surface: direct light as a mean over points of them,
/// indirect light from the patches, and emission.
class SurfaceLighter {
 public:
  /// `samples_per_piece` >= 1 and `emitter_samples` as in LitMeshSettings. All arguments must
  /// outlive the object. Throws Error if a texture cannot be decoded.
  SurfaceLighter(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                 int samples_per_piece, int emitter_samples);

  const DisplaySurface& surface() const { return surface_; }
  int samples_per_piece() const { return samples_per_piece_; }

  /// The colours of `pieces` relative to the screen's white, with their base colour texture or with
  /// a white one. `first` is the number of the first piece. `samples` are points of the pieces:
  /// CameraSample::pixel is the number of the piece, index that of the sample, below
  /// samples_per_piece. Samples inside solid bodies, as below a box that stands on a floor, are
  /// ignored.
  std::vector<glm::vec3> shown(std::uint32_t first, std::span<const LitPiece> pieces,
                               std::span<const CameraSample> samples, float exposure_scale,
                               bool textured) const;

 private:
  std::vector<CameraSample> uncovered(std::span<const CameraSample> samples) const;
  std::vector<glm::vec3> direct_irradiance(std::uint32_t first, std::size_t piece_count,
                                           std::span<const CameraSample> samples) const;

  const TransferData& data_;
  const RayTracer& tracer_;
  const PictureLight& light_;
  int samples_per_piece_;
  DisplaySurface surface_;
  Emitters emitters_;
  VertexLight vertex_light_;
};

}  // namespace rebounce
