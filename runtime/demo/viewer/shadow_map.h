#pragma once

#include <glm/glm.hpp>

#include "gl_objects.h"
#include "gl_program.h"
#include "gpu_bodies.h"
#include "gpu_scene.h"
#include "rebounce/transfer/scene_description.h"

namespace rebounce {

/// A box around the scene.
struct SceneBounds {
  glm::vec3 low, high;
  float diagonal() const { return glm::length(high - low); }
};

/// What casts shadows: the scene, and what moves through it.
struct ShadowCasters {
  const GpuScene& scene;
  const GpuBodies& bodies;
  SceneBounds bounds;
  int version = 0;  ///< another one for other bodies, or where they have moved

  void draw() const {
    scene.draw_surface();
    bodies.draw_surface();
  }
};

/// What one lamp sees: a cube of depths around a point or spot light, one plane for a directional
/// one. Drawn anew only when the lamp or a caster has moved.
class ShadowMap {
 public:
  /// Makes the map fit `light`; `program` draws depths.
  void update(const Light& light, const ShadowCasters& casters, const GlProgram& program);

  /// Binds the map to texture units 2 (cube), 3 (plane) and 4 (the cube's depths) and sets the
  /// uniforms of shaders::kLampFragment that say how to look it up.
  void bind(const GlProgram& program) const;

  /// Allocates; `cube_side` and `plane_side` in texels.
  ShadowMap(int cube_side, int plane_side);

 private:
  void draw_cube(const Light& light, const ShadowCasters& casters, const GlProgram& program);
  void draw_plane(const Light& light, const ShadowCasters& casters, const GlProgram& program);

  int cube_side_, plane_side_;
  GlTexture cube_, plane_;
  GlSampler depth_sampler_;
  GlFramebuffer framebuffer_;
  bool drawn_ = false;
  Light drawn_for_;
  int drawn_version_ = 0;  // of the casters
  glm::mat4 plane_from_world_{1};
  glm::vec2 near_far_{0.01F, 1};
  float texel_ = 0, smallest_offset_ = 0;
};

}  // namespace rebounce
