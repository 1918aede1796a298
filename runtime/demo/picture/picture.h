#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "rebounce/sky.h"
#include "runtime/demo/image/images.h"
#include "runtime/demo/shading/picture_light.h"
#include "runtime/rays/ray_tracer.h"

namespace rebounce {

struct TransferData;

/// What a picture shows.
enum class Show : std::uint8_t {
  kDirect,     ///< light directly from lamps, sky and emitters, and the emitters themselves
  kIndirect,   ///< only light that has bounced at least once
  kRadiosity,  ///< both
  kPatches,    ///< every patch in a colour of its own
  kError,      ///< a number per patch in a colour map (viridis)
};

inline bool shows_light(Show show) {
  return show != Show::kPatches && show != Show::kError;
}

struct PictureSettings {
  int width = 1280;  ///< pixels
  int height = 720;  ///< pixels
  Camera camera;     ///< the horizontal field of view follows from the aspect ratio
  Show show = Show::kRadiosity;
  std::optional<float> exposure;  ///< stops; unset: computed from the picture
  int samples_per_axis = 4;  ///< camera rays per pixel = its square; more: smoother edges, slower
  int emitter_samples = 64;  ///< per pixel; more: less grain in the shadows of emitters, slower
  float error_top = 0;       ///< the value at the top of the colour map; 0: the largest one
};

/// Draws pictures of one scene; keeps its decoded textures between pictures.
///
/// One-sided surfaces are invisible from behind (a camera outside a closed room sees into it) but
/// cast shadows from both sides. Gives the same bits for any number of OpenMP threads.
class PictureRenderer {
 public:
  /// `data` and `tracer` must outlive the renderer; `tracer` holds the first surface_count()
  /// triangles of data.mesh. Throws Error if a texture cannot be decoded.
  PictureRenderer(const TransferData& data, const RayTracer& tracer);
  ~PictureRenderer();
  PictureRenderer(PictureRenderer&&) noexcept;
  PictureRenderer& operator=(PictureRenderer&&) noexcept;

  /// Throws Error if a size or a setting cannot be used.
  Picture render(const PictureLight& light, const PictureSettings& settings) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One picture: PictureRenderer(data, tracer).render(light, settings).
Picture render_picture(const TransferData& data, const RayTracer& tracer, const PictureLight& light,
                       const PictureSettings& settings);

/// The exposure in stops for what `camera` sees of the scene, found from a small picture of 16:9:
/// the same for pictures of any size, baked scenes and the viewer. `show` is a kind of light.
float exposure_for(const PictureRenderer& renderer, const PictureLight& light, const Camera& camera,
                   Show show = Show::kRadiosity);

}  // namespace rebounce
