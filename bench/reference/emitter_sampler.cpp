#include "bench/reference/emitter_sampler.h"

#include "precompute/patches/texture_sampling.h"
#include "runtime/rays/float3_glm.h"
#include "runtime/rays/sampling.h"

namespace rebounce::reference {
namespace {

// Mean luminance over the triangle and the channels.
double mean_luminance(const SceneSurface& surface, std::uint32_t triangle) {
  const Scene& scene = surface.scene();
  const Uint3& corner = scene.triangle[triangle];
  const auto corners_of = [&](const std::vector<Float2>& texcoord) {
    return std::array{texcoord[corner[0]], texcoord[corner[1]], texcoord[corner[2]]};
  };
  const Float3 mean =
      mean_emitted_luminance(scene, surface.material(triangle), corners_of(scene.emissive_texcoord),
                             corners_of(scene.base_color_texcoord));
  return (static_cast<double>(mean[0]) + mean[1] + mean[2]) / kChannelCount;
}

}  // namespace

EmitterSampler::EmitterSampler(const SceneSurface& surface)
    : surface_(&surface), area_density_(surface.scene().triangle.size(), 0.0) {
  for (std::uint32_t t = 0; t < area_density_.size(); ++t) {
    const double luminance = mean_luminance(surface, t);
    if (!(luminance > 0)) continue;
    emitters_.push_back(t);
    choice_.add(luminance * area_of(surface.corners(t)));
    area_density_[t] = luminance;
  }
  for (const std::uint32_t t : emitters_) area_density_[t] /= choice_.total();
}

EmitterPoint EmitterSampler::sample(double choice, const glm::dvec2& square) const {
  const std::uint32_t triangle = emitters_[choice_.choose(choice).index];
  const glm::dvec2 barycentric = square_to_triangle(square);
  const TriangleCorners corners = surface_->corners(triangle);
  return {triangle, barycentric, point_at(corners, barycentric), front_normal(corners)};
}

}  // namespace rebounce::reference
