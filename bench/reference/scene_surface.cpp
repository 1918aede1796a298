#include "bench/reference/scene_surface.h"

#include <numbers>

#include "precompute/patches/patch_model.h"
#include "precompute/patches/texture_sampling.h"
#include "runtime/rays/float3_glm.h"

namespace rebounce::reference {
namespace {

glm::dvec3 interpolate(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                       const glm::dvec2& barycentric) {
  return a + barycentric.x * (b - a) + barycentric.y * (c - a);
}

}  // namespace

glm::dvec3 SceneSurface::reflectance(std::uint32_t triangle, const glm::dvec2& barycentric) const {
  const Material& m = material(triangle);
  const Uint3& corner = scene_->triangle[triangle];
  const auto& color = scene_->vertex_color;
  const glm::dvec3 vertex_color =
      interpolate(to_dvec3(color[corner[0]]), to_dvec3(color[corner[1]]),
                  to_dvec3(color[corner[2]]), barycentric);
  const glm::dvec3 texture =
      texture_color(m.base_color_texture, scene_->base_color_texcoord, triangle, barycentric);
  return glm::min(to_dvec3(m.base_color) * vertex_color * texture,
                  static_cast<double>(kMaxReflectance));
}

glm::dvec3 SceneSurface::emitted_exitance(std::uint32_t triangle,
                                          const glm::dvec2& barycentric) const {
  const Material& m = material(triangle);
  if (m.emitted_luminance == Float3{0, 0, 0}) return glm::dvec3(0);
  return std::numbers::pi * to_dvec3(m.emitted_luminance) *
         texture_color(m.emissive_texture, scene_->emissive_texcoord, triangle, barycentric);
}

glm::dvec3 SceneSurface::texture_color(std::uint32_t texture, std::span<const Float2> texcoord,
                                       std::uint32_t triangle,
                                       const glm::dvec2& barycentric) const {
  if (texture == kNone) return glm::dvec3(1);
  const Uint3& corner = scene_->triangle[triangle];
  const auto at = [&](std::size_t axis) {
    const double first = texcoord[corner[0]][axis];
    return static_cast<float>(first + barycentric.x * (texcoord[corner[1]][axis] - first) +
                              barycentric.y * (texcoord[corner[2]][axis] - first));
  };
  return to_dvec3(
      sample_texture(scene_->textures[texture], scene_->images[texture], {at(0), at(1)}));
}

}  // namespace rebounce::reference
