#pragma once

#include "precompute/import/scene.h"
#include "transfer/data/opacity_maps.h"

namespace rebounce {

/// One sRGB byte as linear light in [0, 1].
float srgb_to_linear(std::uint8_t value);

/// The colour of the image in linear light at `texcoord`, bilinearly filtered, wrapped as `texture`
/// says.
Float3 sample_texture(const Texture& texture, const Image& image, Float2 texcoord);

/// The largest number of samples of a triangle: 1,024 stratified samples find the mean of
/// black-and-white noise within about 1 %.
inline constexpr int kMostTextureSamples = 1024;

/// Base colour (linear: factor x texture x vertex colour) averaged over the triangle with these
/// texture coordinates and vertex colours, by stratified samples weighted by opacity_at(); more
/// samples where more texels are covered. A triangle whose mean is part of a mean over many needs
/// fewer samples: at most about `most`, at least 16.
Float3 mean_base_color(const Scene& scene, const Material& material,
                       const std::array<Float2, 3>& texcoord,
                       const std::array<Float3, 3>& vertex_color, int most = kMostTextureSamples);

/// Emitted luminance in cd/m², averaged in the same way; `texcoord` are those of the emissive
/// texture.
Float3 mean_emitted_luminance(const Scene& scene, const Material& material,
                              const std::array<Float2, 3>& texcoord,
                              const std::array<Float2, 3>& base_color_texcoord,
                              int most = kMostTextureSamples);

/// The fraction of light that does not pass through the surface at the base colour texture
/// coordinate `texcoord`, in [0, 1]: 1 for opaque materials; 0 or 1 by the cutoff for masks; the
/// alpha for blended materials. Transmission is not included.
float opacity_at(const Scene& scene, const Material& material, Float2 texcoord);

/// The opacity averaged over the triangle with these texture coordinates, in the same way.
float mean_opacity(const Scene& scene, const Material& material,
                   const std::array<Float2, 3>& texcoord);

}  // namespace rebounce
