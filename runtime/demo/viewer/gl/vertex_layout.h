#pragma once

#include <cstddef>
#include <span>

#include "runtime/demo/viewer/gl/gl_objects.h"

namespace rebounce {

/// The inputs of shaders::kSceneVertex, by location.
enum Attribute : GLuint {
  kPositionAttribute,
  kNormalAttribute,
  kColorAttribute,
  kBaseColorTexcoordAttribute,
  kEmissiveTexcoordAttribute,
  kFirstFlightAttribute,
  kBouncedAttribute,
};

/// Replaces the contents of `buffer`.
template <typename T>
void fill(GLenum target, const GlBuffer& buffer, std::span<const T> values, GLenum usage) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(values.size_bytes()), values.data(), usage);
}

/// Defines `attribute` of the bound vertex array as `components` floats of the bound buffer, at
/// `offset` bytes, every `stride` bytes.
inline void point_to(Attribute attribute, int components, std::size_t stride, std::size_t offset) {
  glEnableVertexAttribArray(attribute);
  glVertexAttribPointer(attribute, components, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                        reinterpret_cast<const void*>(offset));  // NOLINT: OpenGL's interface
}

}  // namespace rebounce
