#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "precompute/import/scene.h"
#include "runtime/rays/triangle.h"

namespace rebounce::reference {

/// Geometry and material of a scene at a point of a triangle, every texel by itself.
class SceneSurface {
 public:
  /// `scene` must outlive it.
  explicit SceneSurface(const Scene& scene) : scene_(&scene) {}

  const Scene& scene() const { return *scene_; }
  TriangleCorners corners(std::uint32_t triangle) const { return corners_of(*scene_, triangle); }
  const Material& material(std::uint32_t triangle) const {
    return scene_->materials[scene_->triangle_material[triangle]];
  }

  /// Base colour x texture x vertex colour, each channel at most kMaxReflectance.
  glm::dvec3 reflectance(std::uint32_t triangle, const glm::dvec2& barycentric) const;

  /// In lx: pi x luminance.
  glm::dvec3 emitted_exitance(std::uint32_t triangle, const glm::dvec2& barycentric) const;

 private:
  glm::dvec3 texture_color(std::uint32_t texture, std::span<const Float2> texcoord,
                           std::uint32_t triangle, const glm::dvec2& barycentric) const;

  const Scene* scene_;
};

}  // namespace rebounce::reference
