#pragma once

// OpenGL 3.3 core, with owners for its objects. Everything here needs a current context.

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <utility>

namespace rebounce {

/// Owns an OpenGL object that `Traits` creates and deletes.
template <typename Traits>
class GlObject {
 public:
  GlObject() { Traits::generate(&name_); }
  ~GlObject() { Traits::remove(&name_); }
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }

  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

struct GlBufferTraits {
  static void generate(GLuint* name) { glGenBuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteBuffers(1, name); }
};
struct GlTextureTraits {
  static void generate(GLuint* name) { glGenTextures(1, name); }
  static void remove(const GLuint* name) { glDeleteTextures(1, name); }
};
struct GlVertexArrayTraits {
  static void generate(GLuint* name) { glGenVertexArrays(1, name); }
  static void remove(const GLuint* name) { glDeleteVertexArrays(1, name); }
};
struct GlFramebufferTraits {
  static void generate(GLuint* name) { glGenFramebuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteFramebuffers(1, name); }
};
struct GlRenderbufferTraits {
  static void generate(GLuint* name) { glGenRenderbuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteRenderbuffers(1, name); }
};

struct GlSamplerTraits {
  static void generate(GLuint* name) { glGenSamplers(1, name); }
  static void remove(const GLuint* name) { glDeleteSamplers(1, name); }
};

using GlBuffer = GlObject<GlBufferTraits>;
using GlTexture = GlObject<GlTextureTraits>;
using GlVertexArray = GlObject<GlVertexArrayTraits>;
using GlFramebuffer = GlObject<GlFramebufferTraits>;
using GlSampler = GlObject<GlSamplerTraits>;
using GlRenderbuffer = GlObject<GlRenderbufferTraits>;

}  // namespace rebounce
