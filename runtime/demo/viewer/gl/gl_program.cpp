#include "runtime/demo/viewer/gl/gl_program.h"

#include <glm/gtc/type_ptr.hpp>
#include <string>

#include "rebounce/error.h"

namespace rebounce {
namespace {

[[noreturn]] void fail(const std::string& what, const std::string& log) {
  throw Error("viewer: this OpenGL cannot " + what +
              "; try another driver: " + log.substr(0, log.find('\n')));
}

class Shader {
 public:
  Shader(GLenum stage, const char* source) : name_(glCreateShader(stage)) {
    glShaderSource(name_, 1, &source, nullptr);
    glCompileShader(name_);
    GLint good = 0;
    glGetShaderiv(name_, GL_COMPILE_STATUS, &good);
    if (good) return;
    std::string log(1024, '\0');
    glGetShaderInfoLog(name_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glDeleteShader(name_);
    fail("compile a shader", log);
  }
  ~Shader() { glDeleteShader(name_); }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;

  GLuint name() const { return name_; }

 private:
  GLuint name_;
};

}  // namespace

GlProgram::GlProgram(const char* vertex_source, const char* fragment_source) {
  const Shader vertex(GL_VERTEX_SHADER, vertex_source);
  const Shader fragment(GL_FRAGMENT_SHADER, fragment_source);
  name_ = glCreateProgram();
  glAttachShader(name_, vertex.name());
  glAttachShader(name_, fragment.name());
  glLinkProgram(name_);
  GLint good = 0;
  glGetProgramiv(name_, GL_LINK_STATUS, &good);
  if (good) return;
  std::string log(1024, '\0');
  glGetProgramInfoLog(name_, static_cast<GLsizei>(log.size()), nullptr, log.data());
  glDeleteProgram(name_);
  fail("link a shader", log);
}

GlProgram::~GlProgram() {
  glDeleteProgram(name_);
}

void GlProgram::set(const char* uniform, int value) const {
  glUniform1i(glGetUniformLocation(name_, uniform), value);
}
void GlProgram::set(const char* uniform, float value) const {
  glUniform1f(glGetUniformLocation(name_, uniform), value);
}
void GlProgram::set(const char* uniform, const glm::vec2& value) const {
  glUniform2fv(glGetUniformLocation(name_, uniform), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* uniform, const glm::vec3& value) const {
  glUniform3fv(glGetUniformLocation(name_, uniform), 1, glm::value_ptr(value));
}
void GlProgram::set(const char* uniform, std::span<const float> values) const {
  glUniform1fv(glGetUniformLocation(name_, uniform), static_cast<GLsizei>(values.size()),
               values.data());
}
void GlProgram::set(const char* uniform, std::span<const glm::vec3> values) const {
  glUniform3fv(glGetUniformLocation(name_, uniform), static_cast<GLsizei>(values.size()),
               glm::value_ptr(values.front()));
}
void GlProgram::set(const char* uniform, const glm::mat4& value) const {
  glUniformMatrix4fv(glGetUniformLocation(name_, uniform), 1, GL_FALSE, glm::value_ptr(value));
}

}  // namespace rebounce
