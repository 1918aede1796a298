#pragma once

#include <glm/glm.hpp>

#include "rebounce/engine.h"
#include "rebounce/lights.h"
#include "runtime/demo/viewer/gl/gl_objects.h"
#include "runtime/demo/viewer/gl/gl_program.h"
#include "runtime/demo/viewer/gl/gpu_bodies.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"

namespace rebounce {

/// A box around the scene.
struct SceneBounds {
  glm::vec3 low, high;
  float diagonal() const { return glm::length(high - low); }
};

/// The objects that cast shadows: the scene, and moving bodies.
struct ShadowCasters {
  const GpuScene& scene;
  const GpuBodies& bodies;
  SceneBounds bounds;
  int version = 0;  ///< changes with the bodies or their positions

  void draw(const GlProgram& program) const {
    // A wall without thickness holds off a lamp at its back from the seams with other walls too:
    // like a wall that is as thick as its shadow map is coarse.
    constexpr float kThickness = 3;  // texels
    program.set("behind_texels", kThickness);
    scene.draw_backs(program);
    program.set("behind_texels", 0.0F);
    scene.draw_surface(program);
    bodies.draw_surface(program);
  }
};

/// The shadow map of one lamp: a cube of depths around a point or spot light, one plane for a
/// directional light, cubes around several points of a lamp with a surface. It is drawn again only
/// if the lamp or a caster has moved.
class ShadowMap {
 public:
  /// Makes the map fit `light`; `program` draws depths. Cubes around points have `cube_side` texels
  /// on each side.
  void update(const Light& light, const ShadowCasters& casters, const GlProgram& program,
              int cube_side);

  /// The map as GpuEngine reads it, of a lamp without a surface; valid until the next update.
  GpuLamp for_card(const Light& light) const;

  /// Binds the map to texture units 2 (cube), 3 (plane), 4 and 5 (cubes on a surface), and sets the
  /// uniforms that lamp_fragment() uses to read it.
  void bind(const GlProgram& program) const;

  ShadowMap();

 private:
  void draw_places(const Light& light, const ShadowCasters& casters, const GlProgram& program);
  /// Draws the depths seen from `eye`; attach(face) selects the face to draw.
  template <typename Attach>
  void draw_faces(const glm::vec3& eye, int side, const ShadowCasters& casters,
                  const GlProgram& program, const Attach& attach);
  void set_reach(const glm::vec3& eye, const SceneBounds& bounds);
  void draw_cube(const Light& light, const ShadowCasters& casters, const GlProgram& program,
                 int side);
  void draw_plane(const Light& light, const ShadowCasters& casters, const GlProgram& program);

  GlTexture cube_, plane_, places_;
  GlSampler depth_sampler_;
  GlFramebuffer framebuffer_;
  bool drawn_ = false;
  Light drawn_for_;
  int drawn_version_ = 0;  // of the casters
  int cube_side_ = 0;      // texels; 0: not drawn
  GpuShadowView plane_view_;
  glm::mat4 plane_from_world_{1};
  glm::vec2 near_far_{0.01F, 1};
  float texel_ = 0, smallest_offset_ = 0;
};

}  // namespace rebounce
