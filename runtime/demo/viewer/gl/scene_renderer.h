#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/demo/picture/picture.h"
#include "runtime/demo/viewer/gl/gl_objects.h"
#include "runtime/demo/viewer/gl/gl_program.h"
#include "runtime/demo/viewer/gl/gpu_bodies.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"
#include "runtime/demo/viewer/gl/render_targets.h"
#include "runtime/demo/viewer/gl/shadow_map.h"
#include "runtime/lights/lamp_kind.h"

namespace rebounce {

/// One frame, for SceneRenderer.
struct FrameSettings {
  int width = 1280;
  int height = 800;
  Camera camera;
  Show show = Show::kRadiosity;
  float exposure = 0;            ///< stops
  std::optional<float> split{};  ///< fraction of the width that shows the first side; unset: all
  std::span<const Light> lights{};
  bool draws_emitter_lamps = false;  ///< as in update_shadows
  Sky sky{};
};

/// Draws a GpuScene: light from its vertices, then each lamp with its shadow map, into a picture
/// with high dynamic range; then exposure, tone curve and encoding as in picture.h.
class SceneRenderer {
 public:
  /// `emitter_lamps` stand for emitting surface, and light the scene alone. They and `scene` must
  /// outlive the renderer.
  SceneRenderer(const GpuScene& scene, const DisplayMesh& mesh,
                std::span<const Light> emitter_lamps);

  /// Sets the moving objects of the next frames: `spheres`, which cast shadows, and lamps.
  /// `keeps_places`: the spheres have not moved.
  void set_bodies(BodyMesh spheres, bool keeps_places, std::span<const Light> lamps);

  /// Updates the shadow maps, one for each light; those of emitter lamps once, if they are drawn.
  void update_shadows(std::span<const Light> lights, bool draws_emitter_lamps);

  /// The map of light k of the last update_shadows.
  const ShadowMap& shadow_map(std::size_t k) const { return *shadow_maps_[k]; }

  const SceneBounds& bounds() const { return bounds_; }

  /// Draws into `framebuffer` (0: the window). Call update_shadows with the same lights first.
  void draw(const FrameSettings& frame, GLuint framebuffer);

 private:
  void draw_sky(const FrameSettings& frame) const;
  void draw_light(const FrameSettings& frame, const glm::mat4& view);
  void draw_lamp_surfaces() const;
  void set_lamp(const Light& light, const ShadowMap& shadow) const;
  void set_lamp_surface(const PreparedLight& lamp) const;
  void draw_patches(const FrameSettings& frame, const glm::mat4& view);
  int split_column(const FrameSettings& frame) const;
  void draw_divider(const FrameSettings& frame) const;
  template <typename Draw>
  void for_each_side(const FrameSettings& frame, const Draw& draw) const;

  const GpuScene& scene_;
  SceneBounds bounds_;
  std::span<const Light> emitter_lamps_;
  GpuBodies spheres_, lamp_surfaces_, no_bodies_;
  int spheres_version_ = 0;
  GlProgram ambient_, lamp_, patch_, shadow_, screen_, sky_;
  GlVertexArray empty_;
  std::vector<std::unique_ptr<ShadowMap>> shadow_maps_, emitter_maps_;
  MultisampledTarget target_;
};

}  // namespace rebounce
