#pragma once

#include <glm/glm.hpp>
#include <span>

#include "runtime/demo/viewer/gl/gl_objects.h"

namespace rebounce {

/// A linked vertex and fragment shader.
class GlProgram {
 public:
  /// Throws Error with the compiler's message if the sources do not compile and link.
  GlProgram(const char* vertex_source, const char* fragment_source);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void use() const { glUseProgram(name_); }

  // Sets a uniform. The program must be in use.
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const glm::vec2& value) const;
  void set(const char* uniform, const glm::vec3& value) const;
  void set(const char* uniform, const glm::mat4& value) const;
  void set(const char* uniform, std::span<const float> values) const;
  void set(const char* uniform, std::span<const glm::vec3> values) const;

 private:
  GLuint name_ = 0;
};

}  // namespace rebounce
