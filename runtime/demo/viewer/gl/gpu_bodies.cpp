#include "runtime/demo/viewer/gl/gpu_bodies.h"

#include <cstddef>
#include <span>
#include <utility>

#include "runtime/demo/viewer/gl/vertex_layout.h"

namespace rebounce {

GpuBodies::GpuBodies(const GpuScene& scene) : scene_(scene) {
  constexpr std::size_t kStride = sizeof(BodyVertex);
  for (std::size_t side = 0; side < kSideCount; ++side) {
    glBindVertexArray(vertex_arrays_[side].name());
    glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
    point_to(kPositionAttribute, 3, kStride, offsetof(BodyVertex, position));
    point_to(kNormalAttribute, 3, kStride, offsetof(BodyVertex, normal));
    point_to(kColorAttribute, 3, kStride, offsetof(BodyVertex, color));
    point_to(kFirstFlightAttribute, 3, kStride, offsetof(BodyVertex, first_flight));
    point_to(kBouncedAttribute, 3, kStride, offsetof(BodyVertex, bounced) + side * sizeof(Float3));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  }
  glBindVertexArray(0);
}

void GpuBodies::upload(BodyMesh mesh) {
  fill<BodyVertex>(GL_ARRAY_BUFFER, vertices_, mesh.vertex, GL_STREAM_DRAW);
  fill<Uint3>(GL_ARRAY_BUFFER, indices_, mesh.triangle, GL_STREAM_DRAW);
  parts_ = std::move(mesh.part);
}

void GpuBodies::draw_triangles(std::uint32_t begin, std::uint32_t end) const {
  glDrawElements(
      GL_TRIANGLES, static_cast<GLsizei>(3 * (end - begin)), GL_UNSIGNED_INT,
      reinterpret_cast<const void*>(begin * sizeof(Uint3)));  // NOLINT: OpenGL's interface
}

void GpuBodies::draw(const GlProgram& program, Side side) const {
  glBindVertexArray(vertex_arrays_[static_cast<std::size_t>(side)].name());
  for (const BodyPart& part : parts_) {
    scene_.set_plain_material(program, part.emitted_luminance);
    draw_triangles(part.begin, part.end);
  }
}

void GpuBodies::draw_surface(const GlProgram& program) const {
  if (parts_.empty()) return;
  scene_.set_plain_material(program, {0, 0, 0});
  glBindVertexArray(vertex_arrays_.front().name());
  draw_triangles(parts_.front().begin, parts_.back().end);
}

}  // namespace rebounce
