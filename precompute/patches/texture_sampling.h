#pragma once

#include "precompute/import/scene.h"

namespace rebounce {

/// One sRGB byte as linear light in [0, 1].
float srgb_to_linear(std::uint8_t value);

/// The image's colour in linear light at `texcoord`, bilinearly filtered, wrapped as `texture`
/// says.
Float3 sample_texture(const Texture& texture, const Image& image, Float2 texcoord);

/// Samples of a triangle at most: 1,024 stratified ones bring the mean of black-and-white noise
/// within about 1 %.
inline constexpr int kMostTextureSamples = 1024;

/// Base colour (linear: factor x texture x vertex colour) averaged over the triangle with these
/// texture coordinates and vertex colours: stratified samples, more where more texels are covered,
/// weighted by opacity_at(). A triangle of many, of which a mean is taken in turn, needs but its
/// part of the samples: about `most` of them, 16 at least.
Float3 mean_base_color(const Scene& scene, const Material& material,
                       const std::array<Float2, 3>& texcoord,
                       const std::array<Float3, 3>& vertex_color, int most = kMostTextureSamples);

/// Emitted luminance in cd/m² averaged over the triangle, likewise; `texcoord` are those of the
/// emissive texture.
Float3 mean_emitted_luminance(const Scene& scene, const Material& material,
                              const std::array<Float2, 3>& texcoord,
                              const std::array<Float2, 3>& base_color_texcoord,
                              int most = kMostTextureSamples);

/// How much of the light that meets the surface where its base colour's texture coordinate is
/// `texcoord` does not pass through, in [0, 1]: 1 for opaque materials; 0 or 1 by the cutoff for
/// masks; the alpha for blended ones. Transmission is not in it.
float opacity_at(const Scene& scene, const Material& material, Float2 texcoord);

/// The same averaged over the triangle with these texture coordinates, likewise.
float mean_opacity(const Scene& scene, const Material& material,
                   const std::array<Float2, 3>& texcoord);

}  // namespace rebounce
