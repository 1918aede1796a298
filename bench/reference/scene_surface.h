#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "rebounce/precompute/scene.h"

namespace rebounce::reference {

/// Three corners, counter-clockwise from the front.
struct TriangleCorners {
  glm::dvec3 a, b, c;

  TriangleCorners(std::span<const Float3> position, const Uint3& triangle);

  /// The point with weights `barycentric` of the second and third corner.
  glm::dvec3 at(const glm::dvec2& barycentric) const;

  glm::dvec3 front_normal() const;  ///< unit; not finite for a triangle without area
  double area() const;              ///< m²
};

/// Geometry and material of a scene at a point of a triangle, every texel by itself.
class SceneSurface {
 public:
  /// `scene` must outlive it.
  explicit SceneSurface(const Scene& scene) : scene_(&scene) {}

  const Scene& scene() const { return *scene_; }
  TriangleCorners corners(std::uint32_t triangle) const {
    return {scene_->position, scene_->triangle[triangle]};
  }
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
