#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/rays/ray_tracer.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// What a picture shows.
enum class Show : std::uint8_t {
  kDirect,     ///< light straight from lamps, sky and emitters, and the emitters themselves
  kIndirect,   ///< only what has bounced at least once
  kRadiosity,  ///< both
  kPatches,    ///< every patch in a colour of its own
  kError,      ///< a number per patch in a colour map (viridis)
};

struct PictureSettings {
  int width = 1280;  ///< pixels
  int height = 720;  ///< pixels
  Camera camera;     ///< the horizontal field of view follows from the aspect ratio
  Show show = Show::kRadiosity;
  std::optional<float> exposure;  ///< stops; unset: found from the picture
  int samples_per_axis = 4;  ///< camera rays per pixel = its square; more: smoother edges, slower
  int emitter_samples = 64;  ///< per pixel; more: less grain in the shadows of emitters, slower
  float error_top = 0;       ///< the number at the top of the colour map; 0: the largest one
};

/// The light to draw with. Per-patch arrays have n entries or none (zero everywhere).
struct PictureLight {
  std::span<const Light> lights{};
  Sky sky{};
  std::span<const Float3> indirect_irradiance{};  ///< H = F B in lx, what the operator gives
  /// F M_e in lx: the part of H that comes straight from emitters. The picture finds it anew in
  /// every pixel, with sharp shadows, and takes only the rest of H from the patches.
  std::span<const Float3> emitted_irradiance{};
  std::span<const float> error{};  ///< >= 0, drawn by Show::kError
};

/// Linear Rec.709, rows from the top. Emitters and sky are drawn no brighter than twice what the
/// exposure takes to white, so that their edges are smooth.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<Float3> pixel{};    ///< [height][width] cd/m², or a colour in [0, 1]
  float exposure = 0;             ///< stops: pixel x 2^exposure is what the tone curve takes
  bool display_referred = false;  ///< pixels are colours (patches, error): no exposure, no curve
};

/// Draws pictures of one scene; keeps its decoded textures from one to the next.
///
/// One-sided surfaces are not seen from behind (a camera outside a closed room looks in), but cast
/// shadows from both sides. The same bits for any number of OpenMP threads.
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

/// Stops that suit a picture of the scene from `camera`, found from a small one.
float exposure_for(const PictureRenderer& renderer, const PictureLight& light,
                   const Camera& camera);

/// F M_e [n] in lx: what arrives straight from the scene's own emitters, for PictureLight.
std::vector<Float3> irradiance_from_emitters(const TransferData& data);

}  // namespace rebounce
