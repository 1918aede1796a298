#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/demo/viewer/gl/body_mesh.h"
#include "runtime/demo/viewer/gl/gl_objects.h"
#include "runtime/demo/viewer/gl/gl_program.h"
#include "runtime/demo/viewer/gl/gpu_scene.h"

namespace rebounce {

/// A BodyMesh on the graphics card; it is replaced in each frame.
class GpuBodies {
 public:
  /// `scene` sets the materials without textures, and must outlive the object.
  explicit GpuBodies(const GpuScene& scene);

  void upload(BodyMesh mesh);

  /// Draws every part, with the light of `side`, as GpuScene::draw_materials does.
  void draw(const GlProgram& program, Side side) const;
  /// Draws all of it once, for shadows, as GpuScene::draw_surface does.
  void draw_surface(const GlProgram& program) const;

 private:
  void draw_triangles(std::uint32_t begin, std::uint32_t end) const;

  const GpuScene& scene_;
  GlBuffer vertices_, indices_;
  std::array<GlVertexArray, kSideCount> vertex_arrays_;
  std::vector<BodyPart> parts_;
};

}  // namespace rebounce
